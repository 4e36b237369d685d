//! The settings of the simulation, each declared once.

/// Declares a struct of settings, a line for each: its name, its type, its default and, where it
/// has a range, the check that refuses what lies outside, in which every setting is there by its
/// name.
macro_rules! settings {
    (
        $(#[$meta:meta])* pub struct $Name:ident, $(#[$of_default:meta])* default {
            $($(#[$of_field:meta])* $field:ident: $Type:ty = $default:expr $(, $check:expr)*;)*
        }
    ) => {
        $(#[$meta])*
        pub struct $Name {
            $($(#[$of_field])* pub $field: $Type,)*
        }

        impl Default for $Name {
            $(#[$of_default])*
            fn default() -> Self {
                Self { $($field: $default,)* }
            }
        }

        impl $Name {
            /// Refuses the first setting that is outside its range.
            #[allow(unused_variables, reason = "not every setting has a range")]
            pub(super) fn check(&self) -> Result<(), super::error::SimError> {
                let Self { $($field,)* } = self;
                $($($check?;)*)*
                Ok(())
            }
        }
    };
}
