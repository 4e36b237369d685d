//! The settings of the simulation, each declared once.

/// Declares a struct of settings, a line for each: its name, type, default and, for a limited
/// range, the check that refuses values outside; the check sees every setting by its name.
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
            /// Refuses the first setting outside its range.
            #[allow(unused_variables, reason = "not every setting has a range")]
            pub(super) fn check(&self) -> Result<(), crate::error::SimError> {
                let Self { $($field,)* } = self;
                $($($check?;)*)*
                Ok(())
            }
        }
    };
}
