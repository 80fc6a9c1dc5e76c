//! Whether links and joints are one tree, and which link is its root.

use super::{Joint, Link, RobotError};
use std::collections::BTreeMap;

/// The root, if the joints hang every link below it exactly once.
pub(super) fn root_of_tree(links: &[Link], joints: &[Joint], file: &str) -> Result<String, RobotError> {
    let refuse = |line: u32, element: String, found: String, wanted: &str| RobotError {
        file: file.to_owned(),
        line,
        element,
        found,
        wanted: wanted.to_owned(),
    };
    let one_tree = "one tree of links with one root";
    let mut joint_above: BTreeMap<&str, Option<&Joint>> = BTreeMap::new();
    for link in links {
        if joint_above.insert(&link.name, None).is_some() {
            let element = format!("link \"{}\"", link.name);
            return Err(refuse(link.line, element, "a second link of this name".into(), "one of each name"));
        }
    }
    let mut joint_names: BTreeMap<&str, ()> = BTreeMap::new();
    for joint in joints {
        let element = format!("joint \"{}\"", joint.name);
        if joint_names.insert(&joint.name, ()).is_some() {
            return Err(refuse(
                joint.line,
                element,
                "a second joint of this name".into(),
                "one of each name",
            ));
        }
        for (end, link) in [("parent", &joint.parent), ("child", &joint.child)] {
            if !joint_above.contains_key(link.as_str()) {
                let found = format!("the {end} \"{link}\", which is no link");
                return Err(refuse(joint.line, element, found, "one of the file's links"));
            }
        }
        let above = joint_above.entry(&joint.child).or_default();
        if let Some(other) = above.replace(joint) {
            let found =
                format!("the child \"{}\", which hangs on joint \"{}\" already", joint.child, other.name);
            return Err(refuse(joint.line, element, found, one_tree));
        }
    }
    let roots: Vec<&Link> = links
        .iter()
        .filter(|link| joint_above.get(link.name.as_str()).is_some_and(Option::is_none))
        .collect();
    let names: Vec<&str> = roots.iter().map(|link| link.name.as_str()).collect();
    let root = match names.as_slice() {
        [root] => *root,
        [] => {
            let found = match links.first() {
                Some(link) => format!("every link on a joint, link \"{}\" too: a ring", link.name),
                None => "no links".to_owned(),
            };
            return Err(refuse(1, "robot".into(), found, one_tree));
        }
        [first, .., _] => {
            let found = format!("{} links that hang on no joint ({})", names.len(), names.join(", "));
            let (second, element) = (roots[1].line, format!("link \"{}\"", names[1]));
            let wanted = format!("{one_tree}; a joint between \"{first}\" and \"{}\" would do", names[1]);
            return Err(refuse(second, element, found, &wanted));
        }
    };
    // With one parent each and one root, a link that does not reach the root hangs in a ring.
    for link in links {
        let mut at = link.name.as_str();
        for _ in 0..links.len() {
            match joint_above.get(at).copied().flatten() {
                Some(joint) => at = &joint.parent,
                None => break,
            }
        }
        if at != root {
            let element = format!("link \"{}\"", link.name);
            return Err(refuse(link.line, element, "a ring of joints above it".into(), one_tree));
        }
    }
    Ok(root.to_owned())
}
