//! The one door to TOML: strict reading with the place of every mistake, for scenarios and suites alike.

use serde::Serialize;
use serde::de::DeserializeOwned;
use std::fmt;
use std::ops::Range;
use toml::de::{DeTable, DeValue};

/// A named TOML text.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Document {
    /// Where the text came from, as a user would name it.
    pub name: String,
    /// The text.
    pub text: String,
}

/// Why a document is refused, and where.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Refusal {
    /// The document, so that the place can be shown in it.
    pub document: Document,
    /// Bytes of the text that the message is about; `None` when it is about the whole.
    pub span: Option<Range<usize>>,
    /// What was found and what was wanted.
    pub message: String,
    /// What to do about it.
    pub help: Option<String>,
}

impl std::error::Error for Refusal {}

impl fmt::Display for Refusal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.line_and_column() {
            Some((line, column)) => write!(f, "{}:{line}:{column}: {}", self.document.name, self.message)?,
            None => write!(f, "{}: {}", self.document.name, self.message)?,
        }
        match &self.help {
            Some(help) => write!(f, " ({help})"),
            None => Ok(()),
        }
    }
}

impl Refusal {
    /// Line and column of the place, counted from one.
    pub fn line_and_column(&self) -> Option<(usize, usize)> {
        let before = self.document.text.get(..self.span.as_ref()?.start)?;
        let line = before.matches('\n').count() + 1;
        let column = before.rsplit('\n').next().map_or(0, |tail| tail.chars().count()) + 1;
        Some((line, column))
    }
}

impl Document {
    /// A text with the name that its messages use.
    pub fn new(name: impl Into<String>, text: impl Into<String>) -> Self {
        Document { name: name.into(), text: text.into() }
    }

    /// A value as a document, every key on a line of its own.
    ///
    /// # Errors
    /// The value cannot be said in TOML.
    pub fn of(value: &impl Serialize) -> Result<Self, Refusal> {
        let text = toml::to_string_pretty(value);
        text.map(|text| Document::new("", text))
            .map_err(|error| Document::new("", "").refuse("", error.to_string(), None))
    }

    /// Reads the document as a value; unknown keys, wrong types and bad syntax are refused at their place.
    pub fn read<T: DeserializeOwned>(&self) -> Result<T, Refusal> {
        toml::from_str(&self.text).map_err(|error| {
            let (message, help) = explain(error.message());
            Refusal { document: self.clone(), span: error.span(), message, help }
        })
    }

    /// A refusal at the key with this dotted path; at the deepest table that exists when the key itself is absent.
    pub fn refuse(&self, path: &str, message: impl Into<String>, help: Option<String>) -> Refusal {
        Refusal { document: self.clone(), span: self.place_of(path), message: message.into(), help }
    }

    /// The document with `key.path = value` put over its own; the value is TOML, or a bare word taken as a string.
    pub fn overridden(&self, assignments: &[String]) -> Result<Document, Refusal> {
        if assignments.is_empty() {
            return Ok(self.clone());
        }
        let mut table: toml::Table = self.read()?;
        for assignment in assignments {
            let whole = |message: String| Refusal {
                document: Document::new("--set", assignment.clone()),
                span: Some(0..assignment.len()),
                message,
                help: Some("write --set table.key=value, for instance --set lidar.dropout_ratio=0.3".into()),
            };
            let (path, value) = assignment
                .split_once('=')
                .ok_or_else(|| whole(format!("`{assignment}` is no assignment: found no `=`")))?;
            set(&mut table, path.trim(), parse_value(value.trim())).map_err(whole)?;
        }
        let text =
            toml::to_string_pretty(&table).map_err(|error| self.refuse("", error.to_string(), None))?;
        Ok(Document::new(format!("{} with --set {}", self.name, assignments.join(" --set ")), text))
    }

    /// The document with another value in the place of the one at a dotted path; what stands on other lines stays there.
    ///
    /// # Errors
    /// Nothing stands at the path, or the value cannot be said in TOML.
    pub fn replaced(&self, path: &str, value: &impl Serialize) -> Result<Document, Refusal> {
        let inline =
            toml::Value::try_from(value).map_err(|error| self.refuse(path, error.to_string(), None))?;
        let Some(place) = self.place_of(path) else {
            return Err(self.refuse(path, format!("found no `{path}` to put a value in its place"), None));
        };
        let mut text = self.text.clone();
        text.replace_range(place, &inline.to_string());
        Ok(Document { name: self.name.clone(), text })
    }

    fn place_of(&self, path: &str) -> Option<Range<usize>> {
        let root = DeTable::parse(&self.text).ok()?;
        let mut table = root.get_ref();
        let mut place = None;
        for part in path.split('.').filter(|part| !part.is_empty()) {
            let (name, index) = match part.split_once('[') {
                Some((name, index)) => (name, index.trim_end_matches(']').parse::<usize>().ok()),
                None => (part, None),
            };
            let Some((key, mut value)) = table.iter().find(|(key, _)| key.get_ref() == name) else { break };
            place = Some(key.span());
            if let (Some(index), DeValue::Array(array)) = (index, value.get_ref())
                && let Some(element) = array.get(index)
            {
                place = Some(element.span());
                value = element;
            }
            match value.get_ref() {
                DeValue::Table(inner) => table = inner,
                _ => {
                    place = Some(value.span());
                    break;
                }
            }
        }
        place
    }
}

fn parse_value(text: &str) -> toml::Value {
    toml::from_str::<toml::Table>(&format!("value = {text}"))
        .ok()
        .and_then(|mut table| table.remove("value"))
        .unwrap_or_else(|| toml::Value::String(text.into()))
}

fn set(table: &mut toml::Table, path: &str, value: toml::Value) -> Result<(), String> {
    match path.split_once('.') {
        None if path.is_empty() => Err("a key is missing before `=`".into()),
        None => {
            table.insert(path.into(), value);
            Ok(())
        }
        Some((head, rest)) => {
            let inner = table.entry(head).or_insert_with(|| toml::Value::Table(toml::Table::new()));
            let kind = inner.type_str();
            let inner = inner.as_table_mut().ok_or_else(|| format!("`{head}` is a {kind}, not a table"))?;
            set(inner, rest, value)
        }
    }
}

/// Turns serde's "unknown field" into a question about the nearest known name.
fn explain(message: &str) -> (String, Option<String>) {
    let message = message.trim();
    for (marker, noun) in [("unknown field `", "key"), ("unknown variant `", "value")] {
        let Some(rest) = message.strip_prefix(marker) else { continue };
        let Some((found, rest)) = rest.split_once('`') else { continue };
        let known: Vec<&str> = rest.split('`').skip(1).step_by(2).collect();
        return (format!("unknown {noun} `{found}`"), Some(suggest(found, &known)));
    }
    (message.to_owned(), None)
}

/// "did you mean" with the nearest of the known names, and all of them.
pub fn suggest(found: &str, known: &[&str]) -> String {
    let nearest = known
        .iter()
        .map(|name| {
            // Two letters swapped in a short name are one slip, however unlike the names are letter by letter. Of two
            // names one slip away, the more alike is meant: `cone` is `cones`, not `none`.
            let slip = strsim::damerau_levenshtein(found, name) <= 1;
            (strsim::jaro_winkler(found, name) + if slip { 1.0 } else { 0.0 }, name)
        })
        .max_by(|a, b| a.0.total_cmp(&b.0))
        .filter(|(likeness, _)| *likeness > 0.7);
    let listing = if known.is_empty() { "none".into() } else { known.join(", ") };
    match nearest {
        Some((_, name)) => format!("did you mean `{name}`? known: {listing}"),
        None => format!("known: {listing}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde::Deserialize;

    #[derive(Debug, Deserialize, PartialEq)]
    #[serde(deny_unknown_fields)]
    struct Wind {
        wind_mps: f64,
    }

    #[derive(Debug, Deserialize, PartialEq)]
    #[serde(deny_unknown_fields)]
    struct Site {
        foliage: Wind,
    }

    #[test]
    fn an_unknown_key_is_refused_at_its_place_with_the_nearest_name() {
        let refusal =
            Document::new("site.toml", "[foliage]\nwind_speed_mps = 5.0\n").read::<Site>().unwrap_err();
        assert_eq!(refusal.line_and_column(), Some((2, 1)));
        assert!(refusal.message.contains("unknown key `wind_speed_mps`"), "{refusal}");
        assert!(refusal.help.unwrap().contains("did you mean `wind_mps`"));
    }

    #[test]
    fn a_wrong_type_and_broken_syntax_name_their_line() {
        for (text, line) in [("[foliage]\nwind_mps = \"fast\"", 2), ("[foliage]\nwind_mps = = 1", 2)] {
            let refusal = Document::new("site.toml", text).read::<Site>().unwrap_err();
            assert_eq!(refusal.line_and_column().unwrap().0, line, "{refusal}");
        }
    }

    #[test]
    fn a_value_refused_after_reading_is_shown_where_it_is_written() {
        let document = Document::new("site.toml", "[foliage]\nwind_mps = -5.0\n");
        let refusal = document.refuse("foliage.wind_mps", "found -5, wanted 0 or more", None);
        assert_eq!(&document.text[refusal.span.clone().unwrap()], "-5.0");
        let absent = document.refuse("foliage.gust_mps", "missing", None);
        assert_eq!(absent.line_and_column(), Some((1, 2)));
    }

    #[test]
    fn an_assignment_overrides_a_key_and_a_bad_one_is_named() {
        let document = Document::new("site.toml", "[foliage]\nwind_mps = 1.0\n");
        let other = document.overridden(&["foliage.wind_mps=4.5".into()]).unwrap();
        assert_eq!(other.read::<Site>().unwrap().foliage.wind_mps, 4.5);
        assert!(
            document.overridden(&["foliage.wind_mps".into()]).unwrap_err().to_string().contains("no `=`")
        );
        let through = document.overridden(&["foliage.wind_mps.x=1".into()]).unwrap_err();
        assert!(through.to_string().contains("not a table"));
    }
}
