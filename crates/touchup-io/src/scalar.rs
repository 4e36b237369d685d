//! Numbers of eight types in binary files and messages.

/// Declares the types: each one's name here, in Rust, and in PLY files.
macro_rules! scalars {
    ($($Scalar:ident: $type:ty = $($name:literal)|+;)*) => {
        /// Type of a number.
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        pub(super) enum Scalar {
            $($Scalar,)*
        }

        impl Scalar {
            /// In the order of `sensor_msgs/msg/PointField`, which counts from 1.
            pub const ALL: &[Self] = &[$(Self::$Scalar),*];

            /// By its name in a PLY file.
            pub fn of_name(name: &str) -> Option<Self> {
                match name {
                    $($($name)|+ => Some(Self::$Scalar),)*
                    _ => None,
                }
            }

            /// Size, bytes.
            pub fn size(self) -> usize {
                match self {
                    $(Self::$Scalar => size_of::<$type>(),)*
                }
            }

            /// The number at the start of `bytes`; every type fits into `f64`.
            #[inline]
            pub fn value(self, bytes: &[u8], big: bool) -> Option<f64> {
                match self {
                    $(Self::$Scalar => {
                        let first = *bytes.first_chunk()?;
                        Some(f64::from(if big { <$type>::from_be_bytes(first) } else { <$type>::from_le_bytes(first) }))
                    })*
                }
            }
        }
    };
}

scalars! {
    I8: i8 = "char" | "int8";
    U8: u8 = "uchar" | "uint8";
    I16: i16 = "short" | "int16";
    U16: u16 = "ushort" | "uint16";
    I32: i32 = "int" | "int32";
    U32: u32 = "uint" | "uint32";
    F32: f32 = "float" | "float32";
    F64: f64 = "double" | "float64";
}
