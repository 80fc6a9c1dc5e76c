//! Nothing lives here: the regression suite is the integration test `suite.rs` and the files that it lists.
