//! How a setting is refused: by its key, what was found and what was wanted.

/// A setting that no robot can walk by.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{key} is {found}, wanted {wanted}")]
pub struct SettingError {
    /// Key within the settings' own table, for instance `duty_ratio`.
    pub key: String,
    /// The value found.
    pub found: String,
    /// What would do.
    pub wanted: String,
}

/// A number that is not finite is in no range.
pub(crate) fn within(key: &str, value: f64, low: f64, high: f64) -> Result<(), SettingError> {
    if (low..=high).contains(&value) {
        return Ok(());
    }
    let wanted = format!("a number from {low} to {high}");
    Err(SettingError { key: key.to_owned(), found: value.to_string(), wanted })
}
