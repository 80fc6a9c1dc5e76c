//! A scenario that no run can be made with is refused with file, place, what was found and what was wanted.

use arborloop_sim::{Document, Refusal, Scenario};

/// The refusal of the cone field with one line in place of another.
fn refused(line: &str, instead: &str) -> Refusal {
    let whole = Scenario::embedded("cone-field-go1-short").unwrap().text;
    let text: Vec<&str> = whole
        .lines()
        .map(|found| if found.split('#').next().unwrap().trim() == line { instead } else { found })
        .collect();
    assert!(text.join("\n") != whole.trim_end(), "the scenario has no line `{line}`");
    Scenario::read(&Document::new("field.toml", text.join("\n"))).unwrap_err()
}

/// Checks the whole message, and that its place is where `instead` stands.
fn check(line: &str, instead: &str, says: &[&str]) {
    let refusal = refused(line, instead);
    let said = refusal.to_string();
    let (row, column) = refusal.line_and_column().unwrap_or_else(|| panic!("{instead}: no place in {said}"));
    assert!(said.starts_with(&format!("field.toml:{row}:{column}: ")), "{said}");
    assert_eq!(refusal.document.text.lines().nth(row - 1), Some(instead), "{said}");
    for wanted in says {
        assert!(said.contains(wanted), "`{said}` does not say `{wanted}`");
    }
}

#[test]
fn an_unknown_key_is_refused_with_the_nearest_known_one() {
    let says = ["unknown key `relief_meters`", "did you mean `relief_m`?", "bump_m"];
    check("relief_m = 0.2", "relief_meters = 0.2", &says);
    check("rate_hz = 10.0", "rate = 10.0", &["unknown key `rate`", "did you mean `rate_hz`?"]);
    check("[gnss]", "[gps]", &["unknown key `gps`", "gnss"]);
}

#[test]
fn an_unknown_value_is_refused_with_the_known_ones() {
    check(r#"model = "vlp16""#, r#"model = "vlp-16""#, &["unknown value `vlp-16`", "did you mean `vlp16`?"]);
    check(r#"kind = "cones""#, r#"kind = "cone""#, &["unknown value `cone`", "did you mean `cones`?"]);
}

#[test]
fn a_wrong_type_is_refused_with_what_was_found_and_wanted() {
    check("speed_mps = 0.5", "speed_mps = \"fast\"", &["string \"fast\"", "expected f64"]);
    check("laps = 1", "laps = -1", &["-1", "u32"]);
    check("height_m = 0.05", "height_m = ", &["value"]);
}

#[test]
fn a_number_outside_physics_is_refused_with_its_bounds() {
    check("relief_m = 0.2", "relief_m = -0.2", &["-0.2", "wanted", "0 to 10"]);
    check("dropout_ratio = 0.01", "dropout_ratio = 1.5", &["found 1.5, wanted 0 to 1"]);
    check("range_noise_m = 0.02", "range_noise_m = nan", &["found NaN, wanted 0 to 10"]);
    check("rate_hz = 10.0", "rate_hz = 40.0", &["found 40, wanted 5 to 20"]);
    check("rate_hz = 10.0", "range_m_max = 130.0", &["found 130", "exceeds the vlp16's 100 m"]);
    check("speed_mps = 0.5", "speed_mps = inf", &["inf", "wanted"]);
}

#[test]
fn a_period_that_is_no_whole_number_of_ticks_is_refused() {
    let says = ["found 13 Hz", "76.923077 ms", "wanted a whole number of ticks of 1 ms"];
    check("rate_hz = 10.0", "rate_hz = 13.0", &says);
    check("rate_hz = 500.0", "rate_hz = 333.0", &["found 333 Hz", "wanted a whole number of ticks"]);
    check("rate_hz = 5.0", "rate_hz = 7.0", &["found 7 Hz", "wanted a whole number of ticks"]);
}

#[test]
fn a_scenario_without_a_route_names_the_missing_key() {
    let text = "schema = 1\nname = \"nowhere\"\n";
    let refusal = Scenario::read(&Document::new("field.toml", text)).unwrap_err();
    let said = refusal.to_string();
    assert!(said.starts_with("field.toml") && said.contains("missing field `route`"), "{said}");
    // A key that is missing has no place of its own: its table has.
    let refusal = refused("waypoints_m = [[0.0, 0.0], [6.0, 0.0], [6.0, 2.0], [0.0, 2.0]]", "");
    let (row, _) = refusal.line_and_column().unwrap();
    assert_eq!(refusal.document.text.lines().nth(row - 1), Some("[route]"));
    assert!(refusal.message.contains("missing field `waypoints_m`"), "{refusal}");
}

#[test]
fn an_override_is_checked_like_the_file_it_changes() {
    let document = Scenario::embedded("cone-field-go1-short").unwrap();
    let changed = document.overridden(&["lidar.dropout_ratio=2.0".into()]).unwrap();
    let said = Scenario::read(&changed).unwrap_err().to_string();
    assert!(said.contains("--set lidar.dropout_ratio=2.0") && said.contains("wanted 0 to 1"), "{said}");
}
