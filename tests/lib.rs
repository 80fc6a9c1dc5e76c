//! Nothing lives here: the regression suite is `suite.rs`.
