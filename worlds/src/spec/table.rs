//! Tables that several plantings share, each planting with defaults of its own.
//!
//! Serde knows one default per type. Here a table is read as a text of optional keys and laid over the planting's own
//! defaults, so that `[world.planting.rows] count = 3` leaves every other key what the planting says.

use serde::de::DeserializeOwned;

/// A value that a text may change in part.
pub(crate) trait Table {
    /// What a file says of it.
    type Text: DeserializeOwned;
    /// The value with what the file says put over it.
    fn with(self, text: Self::Text) -> Self;
}

/// Values without keys are replaced as a whole.
macro_rules! whole {
    ($($kind:ty),* $(,)?) => {$(
        impl $crate::spec::table::Table for $kind {
            type Text = $kind;
            fn with(self, text: $kind) -> $kind {
                text
            }
        }
    )*};
}

/// Declares a table and its text.
macro_rules! table {
    (
        $(#[$about:meta])*
        pub struct $name:ident read as $text:ident {
            $($(#[$doc:meta])* pub $key:ident: $kind:ty,)*
        }
    ) => {
        $(#[$about])*
        #[derive(serde::Serialize, Debug, Clone, PartialEq)]
        pub struct $name {
            $($(#[$doc])* pub $key: $kind,)*
        }

        #[derive(serde::Deserialize)]
        #[serde(deny_unknown_fields)]
        pub(crate) struct $text {
            $($key: Option<<$kind as $crate::spec::table::Table>::Text>,)*
        }

        impl $crate::spec::table::Table for $name {
            type Text = $text;
            fn with(self, text: $text) -> $name {
                $name {
                    $($key: match text.$key {
                        Some(text) => $crate::spec::table::Table::with(self.$key, text),
                        None => self.$key,
                    },)*
                }
            }
        }
    };
}

/// A planting is read over its own defaults.
macro_rules! read_over_defaults {
    ($name:ident, $text:ident) => {
        impl<'de> serde::Deserialize<'de> for $name {
            fn deserialize<D: serde::Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
                let text = <$text as serde::Deserialize>::deserialize(deserializer)?;
                Ok($crate::spec::table::Table::with($name::default(), text))
            }
        }
    };
}

pub(crate) use {read_over_defaults, table, whole};

whole!(f64, usize, Vec<f64>, Vec<[f64; 2]>);
