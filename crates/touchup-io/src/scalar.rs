//! Numbers of eight types in binary files and messages.

/// Type of a number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Scalar {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    F32,
    F64,
}

impl Scalar {
    /// In the order in which `sensor_msgs/msg/PointField` counts them, from 1 on.
    pub const ALL: [Self; 8] = [Self::I8, Self::U8, Self::I16, Self::U16, Self::I32, Self::U32, Self::F32, Self::F64];

    /// Bytes that it takes.
    pub fn size(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::I32 | Self::U32 | Self::F32 => 4,
            Self::F64 => 8,
        }
    }

    /// The number at the start of `bytes`; every type fits into `f64`.
    #[inline]
    pub fn value(self, bytes: &[u8], big: bool) -> Option<f64> {
        /// The first N bytes, least significant first.
        #[inline]
        fn little<const N: usize>(bytes: &[u8], big: bool) -> Option<[u8; N]> {
            let mut first = *bytes.first_chunk::<N>()?;
            if big {
                first.reverse();
            }
            Some(first)
        }
        Some(match self {
            Self::I8 => f64::from(i8::from_le_bytes(little(bytes, big)?)),
            Self::U8 => f64::from(u8::from_le_bytes(little(bytes, big)?)),
            Self::I16 => f64::from(i16::from_le_bytes(little(bytes, big)?)),
            Self::U16 => f64::from(u16::from_le_bytes(little(bytes, big)?)),
            Self::I32 => f64::from(i32::from_le_bytes(little(bytes, big)?)),
            Self::U32 => f64::from(u32::from_le_bytes(little(bytes, big)?)),
            Self::F32 => f64::from(f32::from_le_bytes(little(bytes, big)?)),
            Self::F64 => f64::from_le_bytes(little(bytes, big)?),
        })
    }
}
