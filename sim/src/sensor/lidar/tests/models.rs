//! Data files: what is refused and where, and that the lidars of the program are their makers'.

use super::super::*;
use super::scene::{model, probe_text};
use crate::document::Document;
use crate::scenario::Scenario;
use arborloop_base::vlp16;

#[test]
fn the_lidars_of_the_program_say_what_their_makers_print() {
    for (name, text) in EMBEDDED {
        assert!(text.starts_with("# "), "{name}: the first line says what it is");
        assert_eq!(LidarModel::embedded(name).unwrap().name, *name);
    }
    let velodyne = LidarModel::embedded("vlp16").unwrap();
    assert_eq!(velodyne.beams.elevation_deg, vlp16::ELEVATION_DEG);
    let schedule = Schedule::new(&velodyne, None, Span::from_millis(100));
    let beams = beams_of(&velodyne, &Pose::translation(0.0, 0.0, 0.16), &Body::go1(), &schedule);
    assert!((0..16).all(|laser| beams[laser].ring == vlp16::ring_of(laser)));
    let ouster = LidarModel::embedded("os1-16").unwrap();
    assert_eq!((ouster.beams.elevation_deg[7], ouster.beams.azimuth_deg[0]), (0.1, -3.387));
    assert_eq!(ouster.modes(), [(512, 10.0), (1024, 10.0), (2048, 10.0), (512, 20.0), (1024, 20.0)]);
}

#[test]
fn a_data_file_that_describes_no_lidar_is_refused_at_its_place() {
    for (line, instead, place, says) in [
        ("elevation_deg = [0.0]", "elevation_deg = [95.0]", "95.0", "found 95, wanted -89 to 89"),
        ("elevation_deg = [0.0]", "elevation_deg = []", "elevation_deg", "found 0 beams"),
        (
            "elevation_deg = [0.0]",
            "elevation_deg = [0.0]\nheight_m = [0.0, 1.0]",
            "height_m",
            "wanted 1, one a beam",
        ),
        ("columns = 3600", "columns = 3601", "columns", "wanted one of `modes`"),
        ("columns = 3600", "columns = 3600\ncycle_ns = 5000", "[turn]", "wanted one of them"),
        ("modes = [\"3600x10\"]", "modes = [\"fast\"]", "modes", "found `fast`"),
        ("edge_ratio = 0.1353352832366127", "edge_ratio = 1.0", "edge_ratio", "wanted 0.001 to 0.999"),
        ("range_m_min = 0.4", "range_m_min = 200.0", "range_m_min", "wanted 0 to 100"),
        ("wire = \"plain\"", "wire = \"vlp16\"", "elevation_deg", "another value than the VLP-16's"),
        ("wire = \"plain\"", "wire = \"plane\"", "wire", "unknown value `plane`"),
        ("reach_m = 40.0", "reech_m = 40.0", "reech_m", "unknown key `reech_m`"),
    ] {
        let refusal = model(&probe_text(line, instead)).unwrap_err();
        let (row, _) =
            refusal.line_and_column().unwrap_or_else(|| panic!("{instead}: no place in {refusal}"));
        let shown = refusal.document.text.lines().nth(row - 1).unwrap();
        assert!(shown.contains(place), "{instead}: {refusal} shows `{shown}`");
        assert!(refusal.to_string().contains(says), "{instead}: {refusal}");
    }
}

#[test]
fn a_lidar_of_the_users_own_goes_into_a_scenario_and_comes_back_from_its_resolved_form() {
    let field = Scenario::embedded("cone-field-go1-short").unwrap();
    let named = field.overridden(&["lidar.model=\"probe.toml\"".into()]).unwrap();
    assert_eq!(lidar_file(&named).as_deref(), Some("probe.toml"));
    assert_eq!(lidar_file(&field), None);
    let refusal = Scenario::read(&named).unwrap_err();
    assert!(refusal.to_string().contains("no file `probe.toml`"), "{refusal}");
    let file = Document::new("probe.toml", probe_text("name", "name"));
    let scenario = Scenario::read(&with_lidar(&named, &file).unwrap()).unwrap();
    assert_eq!(scenario.lidar.model.name, "probe");
    assert_eq!(scenario.wire(), Wire::Plain);
    let again = Scenario::read(&Document::new("resolved", scenario.resolved())).unwrap();
    assert_eq!(scenario, again);
    // The name of a lidar of the program cannot be taken by another.
    let taken = Document::new("probe.toml", probe_text("name = \"probe\"", "name = \"vlp16\""));
    assert!(with_lidar(&named, &taken).unwrap_err().message.contains("comes with the program"));
}

#[test]
fn weather_and_faults_of_a_scenario_are_checked_and_come_back_from_its_resolved_form() {
    let field = Scenario::embedded("cone-field-go1-short").unwrap();
    let with = |text: &str| Document::new("field.toml", format!("{}\n{text}\n", field.text));
    let read = |text: &str| Scenario::read(&with(text));
    let faults = r#"
[weather]
rain_mm_per_h = 12.0
dust_visibility_m = 80.0
[[fault]]
kind = "blackout"
from_s = 3.0
for_s = 0.5
[[fault]]
kind = "swapped_rings"
from_s = 5.0
for_s = 1.0
rings = [3, 12]
"#;
    let scenario = read(faults).unwrap();
    assert_eq!((scenario.fault.len(), scenario.weather.rain_mm_per_h), (2, 12.0));
    assert_eq!(Scenario::read(&Document::new("resolved", scenario.resolved())).unwrap(), scenario);
    for (text, says) in [
        ("[weather]\nrain_mm_per_h = -1.0", "found -1, wanted 0 to 500"),
        ("[weather]\nfog_visibility_m = 0.0", "found 0, wanted 1 to 100000"),
        ("[weather]\nsnow = 1.0", "unknown key `snow`"),
        ("[[fault]]\nkind = \"blakout\"\nfrom_s = 1.0\nfor_s = 1.0", "did you mean `blackout`?"),
        ("[[fault]]\nkind = \"blackout\"\nfrom_s = 1.0", "missing field `for_s`"),
        ("[[fault]]\nkind = \"blackout\"\nfrom_s = -1.0\nfor_s = 1.0", "found -1, wanted 0"),
        (
            "[[fault]]\nkind = \"swapped_rings\"\nfrom_s = 0.0\nfor_s = 1.0\nrings = [0, 16]",
            "found 16, wanted 0 to 15",
        ),
        (
            "[[fault]]\nkind = \"skewed_stamps\"\nfrom_s = 0.0\nfor_s = 1.0\noffset_s = 0.06",
            "wanted -0.049 to 0.049",
        ),
        (
            "[[fault]]\nkind = \"dropped_packets\"\nfrom_s = 0.0\nfor_s = 1.0\nratio = 2.0",
            "found 2, wanted 0 to 1",
        ),
    ] {
        let said = read(text).unwrap_err().to_string();
        assert!(said.contains(says), "{text}: {said}");
    }
}

#[test]
fn modes_and_returns_that_a_lidar_has_not_are_refused() {
    let field = Scenario::embedded("cone-field-go1-short").unwrap();
    for (set, says) in [
        (
            &["lidar.model=os1-16", "lidar.columns=2048", "lidar.rate_hz=20.0"][..],
            "one of the os1-16's modes",
        ),
        (&["lidar.model=os1-16", "lidar.returns=dual"], "found `dual`, wanted one of strongest"),
        (&["lidar.returns=first"], "found `first`, wanted one of strongest, last, dual"),
        (&["lidar.columns=1024"], "which a turn of the vlp16 has not"),
        (&["lidar.sub_rays=6"], "found 6, wanted one of [1, 5, 7, 19, 37]"),
        (&["lidar.model=os2"], "unknown value `os2`"),
    ] {
        let set: Vec<String> = set.iter().map(|one| (*one).to_owned()).collect();
        let said = Scenario::read(&field.overridden(&set).unwrap()).unwrap_err().to_string();
        assert!(said.contains(says), "{set:?}: {said}");
    }
}
