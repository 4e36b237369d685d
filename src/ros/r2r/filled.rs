//! Messages for tests, with another value in every field: numbers count up, each kind by itself; lists have two items.

use serde::de::value::Error;
use serde::de::{DeserializeOwned, DeserializeSeed, Deserializer, SeqAccess, Visitor};

/// A message, filled.
pub(super) fn filled<T: DeserializeOwned>() -> T {
    T::deserialize(&mut Filler::default()).unwrap()
}

#[derive(Default)]
struct Filler {
    bools: u8,
    bytes: u8,
    wholes: u32,
    numbers: f32,
    words: u32,
}

macro_rules! fills {
    ($($method:ident, $visit:ident: $self:ident => $value:expr;)+) => {
        $(fn $method<V: Visitor<'de>>($self, visitor: V) -> Result<V::Value, Error> {
            visitor.$visit($value)
        })+
    };
}

impl<'de> Deserializer<'de> for &mut Filler {
    type Error = Error;

    fills! {
        deserialize_bool, visit_bool: self => {
            self.bools += 1;
            self.bools % 2 == 1
        };
        deserialize_u8, visit_u8: self => {
            self.bytes = self.bytes.checked_add(1).expect("more than 255 bytes in one message");
            self.bytes
        };
        deserialize_i32, visit_i32: self => -(self.whole() as i32);
        deserialize_i64, visit_i64: self => -i64::from(self.whole());
        deserialize_u32, visit_u32: self => self.whole();
        deserialize_u64, visit_u64: self => 1 << 40 | u64::from(self.whole());
        deserialize_f32, visit_f32: self => self.number();
        deserialize_f64, visit_f64: self => f64::from(self.number()) + 1e-9;
        deserialize_string, visit_string: self => {
            self.words += 1;
            format!("word {} é", self.words)
        };
    }

    fn deserialize_seq<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Error> {
        visitor.visit_seq(Items { filler: self, left: 2 })
    }

    fn deserialize_struct<V: Visitor<'de>>(
        self,
        _: &'static str,
        fields: &'static [&'static str],
        visitor: V,
    ) -> Result<V::Value, Error> {
        visitor.visit_seq(Items { filler: self, left: fields.len() })
    }

    fn deserialize_any<V: Visitor<'de>>(self, _: V) -> Result<V::Value, Error> {
        Err(serde::de::Error::custom("no message has such a field"))
    }

    serde::forward_to_deserialize_any! {
        i8 i16 i128 u16 u128 char str bytes byte_buf option unit unit_struct newtype_struct tuple tuple_struct map enum
        identifier ignored_any
    }
}

impl Filler {
    fn whole(&mut self) -> u32 {
        self.wholes += 1;
        self.wholes
    }

    fn number(&mut self) -> f32 {
        self.numbers += 0.5;
        self.numbers
    }
}

struct Items<'a> {
    filler: &'a mut Filler,
    left: usize,
}

impl<'de> SeqAccess<'de> for Items<'_> {
    type Error = Error;

    fn next_element_seed<T: DeserializeSeed<'de>>(&mut self, seed: T) -> Result<Option<T::Value>, Error> {
        if self.left == 0 {
            return Ok(None);
        }
        self.left -= 1;
        seed.deserialize(&mut *self.filler).map(Some)
    }
}
