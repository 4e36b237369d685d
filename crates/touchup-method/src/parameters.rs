//! Scene parameters, each declared once, in its own module.
//!
//! [`parameters!`](crate::parameters!) generates from one declaration the struct in SI units, its
//! defaults, its range check, its YAML reader, and a [`Parameter`] for each key. The scene template
//! and the table of docs/scene.md come from these:
//!
//! ```
//! use touchup_method::{parameters, parameters::Section};
//! parameters! {
//!     /// Closing of a door.
//!     #[derive(Clone, Debug, PartialEq)]
//!     pub struct DoorParams in "door" {
//!         /// The door is closed by this force.
//!         ///
//!         /// The user sees the first paragraph only: the reason for the default stands here.
//!         force: f64 = 4.0, "force_n" [N, 0, 100];
//!         /// Width of the opening; left out: as far as it goes.
//!         opening: Option<f64> = None, "opening_mm" [MM, 1, 2000] like "800";
//!         /// Not in the scene.
//!         count: usize = 0;
//!     }
//! }
//! assert_eq!(DoorParams::default(), DoorParams { force: 4.0, opening: None, count: 0 });
//! let wide = DoorParams { opening: Some(3.0), ..DoorParams::default() };
//! assert_eq!(wide.check().unwrap_err().to_string(), "door.opening_mm is 3000; it must be 1 to 2000 mm; it is left out by default");
//! ```
//!
//! `with { part: Part }` at the end adds the keys of `Part` to the section; `check path;` checks
//! conditions across several parameters.

use std::fmt;
use std::marker::PhantomData;
use std::path::PathBuf;

use nalgebra::{Point3, Vector3};
use serde::Deserialize;
use serde::de::{
    DeserializeOwned, DeserializeSeed, Deserializer, Error, MapAccess, Unexpected, Visitor,
};

/// Parameter value outside its valid range.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{name} is {}; it must be {allowed}", Number(*.value))]
pub struct SettingError {
    /// key in the scene, or quantity with its unit
    pub name: String,
    /// value, in the unit of `allowed`
    pub value: f64,
    /// valid range
    pub allowed: String,
}

impl SettingError {
    /// Refuses a value that is not finite or not `inside` the range that `allowed` names.
    ///
    /// # Errors
    /// [`SettingError`], with the name and the value.
    pub fn check(name: &str, value: f64, inside: bool, allowed: &str) -> Result<(), SettingError> {
        if inside && value.is_finite() {
            return Ok(());
        }
        Err(SettingError {
            name: name.to_owned(),
            value,
            allowed: allowed.to_owned(),
        })
    }
}

/// Number for display: twelve digits, powers of ten for large and small values.
struct Number(f64);

impl fmt::Display for Number {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let rounded = format!("{:.11e}", self.0).parse().unwrap_or(self.0);
        let is_plain =
            rounded == 0.0 || !rounded.is_finite() || (1e-4..1e6).contains(&rounded.abs());
        if is_plain {
            write!(f, "{rounded}")
        } else {
            write!(f, "{rounded:e}")
        }
    }
}

/// Unit of a key.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Unit {
    /// printed after a number; empty for a pure number
    pub symbol: &'static str,
    /// `count` of this unit equal `size` of SI; one of the two is 1, so a conversion rounds once
    count: f64,
    size: f64,
}

macro_rules! units {
    ($($NAME:ident $symbol:literal $(per $count:literal)? $(times $size:expr)?;)*) => {
        impl Unit {
            const SI: Self = Self { symbol: "", count: 1.0, size: 1.0 };
            $(
                #[doc = concat!("`", $symbol, "`")]
                pub const $NAME: Self = Self { symbol: $symbol, $(count: $count,)? $(size: $size,)? ..Self::SI };
            )*
        }
    };
}

units! {
    ONE "";
    N "N";
    NM "N·m";
    KG "kg";
    HZ "Hz";
    S "s";
    DAYS "days";
    CELSIUS "°C";
    PER_S "1/s";
    M_PER_S2 "m/s²";
    M_PER_N_S "m/(N·s)";
    PER_N2_S "1/(N²·s)";
    MESSAGES "messages";
    TOUCHES "touches";
    EDGES "mean edges";
    SIGMAS "standard deviations";
    QUATERNION "(length of the quaternion)";
    MM "mm" per 1e3;
    MM_PER_S "mm/s" per 1e3;
    MM_PER_M "mm/m" per 1e3;
    MM_PER_S2 "mm/s²" per 1e3;
    MS "ms" per 1e3;
    PPM "ppm" per 1e6;
    PERCENT "%" per 100.0;
    N_PER_MM "N/mm" times 1e3;
    DEG "degrees" times std::f64::consts::PI / 180.0;
    DEG_PER_S "degrees/s" times std::f64::consts::PI / 180.0;
}

impl Unit {
    /// Converts a number of this unit to SI.
    pub fn to_si(self, x: f64) -> f64 {
        x / self.count * self.size
    }

    /// Converts a number of SI to this unit.
    pub fn of_si(self, x: f64) -> f64 {
        x * self.count / self.size
    }
}

/// Declaration of one key.
#[derive(Clone, Debug, PartialEq)]
pub struct Parameter {
    /// section with its parents: `compensation.payload`; empty at the top level
    pub section: &'static str,
    /// key in the section
    pub key: &'static str,
    /// unit of its numbers
    pub unit: Unit,
    /// smallest and largest number, in `unit`
    pub range: Option<[f64; 2]>,
    /// remark on the range
    pub hint: &'static str,
    /// allowed words
    pub words: &'static [&'static str],
    /// default, as YAML; `None`: absent
    pub default: Option<String>,
    /// example for an absent key, as YAML
    pub example: &'static str,
    /// documentation, line by line
    pub doc: &'static [&'static str],
    /// parameters of a section
    pub inner: Vec<Parameter>,
    /// whether the key is a section
    pub is_section: bool,
    /// whether its value is a list of sections
    pub is_list: bool,
}

impl Parameter {
    /// Full name: section and key.
    pub fn name(&self) -> String {
        if self.section.is_empty() {
            self.key.to_owned()
        } else {
            format!("{}.{}", self.section, self.key)
        }
    }

    /// First paragraph of the documentation.
    pub fn summary(&self) -> String {
        let lines = self
            .doc
            .iter()
            .map(|line| line.trim())
            .take_while(|line| !line.is_empty());
        lines.collect::<Vec<_>>().join(" ")
    }

    /// Range, or words; empty if every value is allowed.
    pub fn allowed(&self) -> String {
        let Some([low, high]) = self.range else {
            return self.words.join(", ");
        };
        format!("{} to {}", Number(low), Number(high))
    }
}

/// Type of a parameter.
pub trait Value: Sized {
    /// Type in the YAML.
    type Written: DeserializeOwned;
    /// Allowed words.
    const WORDS: &'static [&'static str] = &[];
    /// Whether the type is a section, optional or not, or a list of them.
    const IS_SECTION: bool = false;
    /// Whether the type is a list of sections.
    const IS_LIST: bool = false;

    /// Converts a YAML value to SI.
    fn of(written: Self::Written, unit: Unit) -> Self;

    /// YAML on one line; `None`: absent.
    fn yaml(&self, unit: Unit) -> Option<String>;

    /// Value of a present key; a section key without a value gives the default section, `off` gives
    /// none.
    fn given(written: Self::Written, unit: Unit) -> Self {
        Self::of(written, unit)
    }

    /// Sets the YAML value at `path` below this one; without a path, this one.
    ///
    /// # Errors
    /// Errors of the deserializer; an unknown key.
    fn set<'de, D: Deserializer<'de>>(
        &mut self,
        path: &[&str],
        written: D,
        unit: Unit,
    ) -> Result<(), D::Error> {
        if let Some(key) = path.first() {
            return Err(D::Error::unknown_field(key, &[]));
        }
        *self = Self::of(Self::Written::deserialize(written)?, unit);
        Ok(())
    }

    /// Default section; `None` for other types.
    fn named() -> Option<Self> {
        None
    }

    /// Whether a section has the YAML value `off`.
    fn is_off(_: &Self::Written) -> bool {
        false
    }

    /// Numbers in SI; the range applies to each.
    fn numbers(&self) -> Vec<f64> {
        vec![]
    }

    /// Checks every parameter of a section.
    ///
    /// # Errors
    /// [`SettingError`]
    fn check(&self) -> Result<(), SettingError> {
        Ok(())
    }

    /// Parameters of a section.
    fn inner() -> Vec<Parameter> {
        vec![]
    }
}

impl Value for f64 {
    type Written = Self;

    fn of(written: Self, unit: Unit) -> Self {
        unit.to_si(written)
    }

    fn yaml(&self, unit: Unit) -> Option<String> {
        Some(Number(unit.of_si(*self)).to_string())
    }

    fn numbers(&self) -> Vec<f64> {
        vec![*self]
    }
}

/// Nanoseconds per second.
const NS: f64 = 1e9;

/// Time in ns. `MIN` represents NaN, `MAX` infinity: both are outside every range.
impl Value for i64 {
    type Written = f64;

    fn of(written: f64, unit: Unit) -> Self {
        // 1 ms is exactly 10⁶ ns, but 0.001 s is inexact
        if written.is_nan() {
            Self::MIN
        } else {
            (written * unit.to_si(NS)).round() as Self
        }
    }

    fn yaml(&self, unit: Unit) -> Option<String> {
        self.numbers()[0].yaml(unit)
    }

    fn numbers(&self) -> Vec<f64> {
        vec![match *self {
            Self::MIN => f64::NAN,
            Self::MAX => f64::INFINITY,
            ns => ns as f64 / NS,
        }]
    }
}

/// Types without unit: their YAML text, and the number in them.
macro_rules! without_unit {
    ($($Type:ty, $text:expr, $number:expr;)*) => {$(
        impl Value for $Type {
            type Written = Self;

            fn of(written: Self, _: Unit) -> Self {
                written
            }

            fn yaml(&self, _: Unit) -> Option<String> {
                let text: fn(&Self) -> String = $text;
                Some(text(self))
            }

            fn numbers(&self) -> Vec<f64> {
                let number: fn(&Self) -> Option<f64> = $number;
                number(self).into_iter().collect()
            }
        }
    )*};
}

without_unit! {
    bool, bool::to_string, |_| None;
    String, |text| format!("'{text}'"), |_| None;
    PathBuf, |path| path.display().to_string(), |_| None;
    usize, usize::to_string, |count| Some(*count as f64);
    // quaternion x, y, z, w as in the YAML; its one number is its length
    [f64; 4], |xyzw| list(xyzw, Unit::ONE), |xyzw| Some(xyzw.iter().map(|c| c * c).sum::<f64>().sqrt());
}

macro_rules! places {
    ($($Type:ty),*) => {$(
        impl Value for $Type {
            type Written = [f64; 3];

            fn of(written: [f64; 3], unit: Unit) -> Self {
                written.map(|x| unit.to_si(x)).into()
            }

            fn yaml(&self, unit: Unit) -> Option<String> {
                Some(list(&self.numbers(), unit))
            }

            fn numbers(&self) -> Vec<f64> {
                self.iter().copied().collect()
            }
        }
    )*};
}

places!(Vector3<f64>, Point3<f64>);

impl<T: Value> Value for Vec<T> {
    type Written = Vec<T::Written>;
    const IS_SECTION: bool = T::IS_SECTION;
    const IS_LIST: bool = T::IS_SECTION;

    fn of(written: Self::Written, unit: Unit) -> Self {
        written.into_iter().map(|one| T::of(one, unit)).collect()
    }

    fn yaml(&self, unit: Unit) -> Option<String> {
        // a list of sections is absent without any
        (!T::IS_SECTION).then(|| list(self, unit))
    }

    fn numbers(&self) -> Vec<f64> {
        self.iter().flat_map(T::numbers).collect()
    }

    fn check(&self) -> Result<(), SettingError> {
        self.iter().try_for_each(T::check)
    }

    fn inner() -> Vec<Parameter> {
        T::inner()
    }
}

fn list<T: Value>(values: &[T], unit: Unit) -> String {
    format!(
        "[{}]",
        values
            .iter()
            .filter_map(|one| one.yaml(unit))
            .collect::<Vec<_>>()
            .join(", ")
    )
}

impl<T: Value> Value for Option<T> {
    type Written = Option<T::Written>;
    const WORDS: &'static [&'static str] = T::WORDS;
    const IS_SECTION: bool = T::IS_SECTION;

    fn of(written: Self::Written, unit: Unit) -> Self {
        written.map(|written| T::of(written, unit))
    }

    fn given(written: Self::Written, unit: Unit) -> Self {
        match written {
            None => T::named(),
            Some(written) if T::is_off(&written) => None,
            Some(written) => Some(T::of(written, unit)),
        }
    }

    fn set<'de, D: Deserializer<'de>>(
        &mut self,
        path: &[&str],
        written: D,
        unit: Unit,
    ) -> Result<(), D::Error> {
        if self.is_none() {
            *self = T::named();
        }
        match (self, path.first()) {
            (Some(value), _) => value.set(path, written, unit),
            (None, Some(key)) => Err(D::Error::unknown_field(key, &[])),
            (empty, None) => {
                *empty = Some(T::of(T::Written::deserialize(written)?, unit));
                Ok(())
            }
        }
    }

    fn yaml(&self, unit: Unit) -> Option<String> {
        self.as_ref()?.yaml(unit)
    }

    fn numbers(&self) -> Vec<f64> {
        self.iter().flat_map(T::numbers).collect()
    }

    fn check(&self) -> Result<(), SettingError> {
        self.iter().try_for_each(T::check)
    }

    fn inner() -> Vec<Parameter> {
        T::inner()
    }
}

/// Parameters under one key; generated by [`parameters!`](crate::parameters!).
pub trait Section: Default {
    /// Section name with its parents.
    const NAME: &'static str;

    /// All keys.
    fn keys() -> &'static [&'static str];

    /// Declaration of each key.
    fn parameters() -> Vec<Parameter>;

    /// Reads the value of `key`; `false` for a key of another section.
    ///
    /// # Errors
    /// Errors of the deserializer.
    fn read_key<'de, A: MapAccess<'de>>(
        &mut self,
        key: &str,
        map: &mut A,
    ) -> Result<bool, A::Error>;
}

/// Refuses the first number of `value` outside the range of `key`.
///
/// # Errors
/// [`SettingError`]
pub fn check<T: Value>(value: &T, key: &str, declared: &[Parameter]) -> Result<(), SettingError> {
    value.check()?;
    let Some(one) = declared.iter().find(|one| one.key == key) else {
        return Ok(());
    };
    let Some([low, high]) = one
        .range
        .map(|range| range.map(|limit| one.unit.to_si(limit)))
    else {
        return Ok(());
    };
    let Some(si) = value
        .numbers()
        .into_iter()
        .find(|si| !(low..=high).contains(si))
    else {
        return Ok(());
    };
    let what_else = match &one.default {
        _ if !one.hint.is_empty() => one.hint.to_owned(),
        None => "it is left out by default".to_owned(),
        Some(default) => format!("the default is {default}"),
    };
    let allowed = format!(
        "{}; {what_else}",
        format!("{} {}", one.allowed(), one.unit.symbol).trim_end()
    );
    Err(SettingError {
        name: one.name(),
        value: one.unit.of_si(si),
        allowed,
    })
}

/// Reads a section; absent keys keep their defaults.
///
/// # Errors
/// Errors of the deserializer; an unknown key.
pub fn read_section<'de, S: Section, D: Deserializer<'de>>(deserializer: D) -> Result<S, D::Error> {
    deserializer.deserialize_struct(S::NAME, S::keys(), SectionVisitor(PhantomData))
}

struct SectionVisitor<S>(PhantomData<S>);

impl<'de, S: Section> Visitor<'de> for SectionVisitor<S> {
    type Value = S;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("keys with values")
    }

    fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<S, A::Error> {
        let mut section = S::default();
        while let Some(key) = map.next_key_seed(KnownKey(S::keys()))? {
            section.read_key(key, &mut map)?;
        }
        Ok(section)
    }
}

/// YAML value of a section key.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum WrittenSection<S> {
    /// keys with values
    Keys(S),
    /// the word `off`: no such part
    Off,
}

impl<S: Default> Default for WrittenSection<S> {
    fn default() -> Self {
        Self::Keys(S::default())
    }
}

impl<'de, S: Section> Deserialize<'de> for WrittenSection<S> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(WrittenSectionVisitor(PhantomData))
    }
}

struct WrittenSectionVisitor<S>(PhantomData<S>);

impl<'de, S: Section> Visitor<'de> for WrittenSectionVisitor<S> {
    type Value = WrittenSection<S>;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("keys with values, or off")
    }

    fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<Self::Value, A::Error> {
        SectionVisitor(PhantomData)
            .visit_map(map)
            .map(WrittenSection::Keys)
    }

    fn visit_str<E: Error>(self, word: &str) -> Result<Self::Value, E> {
        if word == "off" {
            Ok(WrittenSection::Off)
        } else {
            Err(E::invalid_value(Unexpected::Str(word), &self))
        }
    }

    // YAML 1.1 reads off as a boolean
    fn visit_bool<E: Error>(self, is_on: bool) -> Result<Self::Value, E> {
        if is_on {
            Err(E::invalid_value(Unexpected::Bool(is_on), &self))
        } else {
            Ok(WrittenSection::Off)
        }
    }
}

/// Seed for one of the known keys.
struct KnownKey(&'static [&'static str]);

impl<'de> DeserializeSeed<'de> for KnownKey {
    type Value = &'static str;

    fn deserialize<D: Deserializer<'de>>(self, deserializer: D) -> Result<&'static str, D::Error> {
        deserializer.deserialize_identifier(self)
    }
}

impl Visitor<'_> for KnownKey {
    type Value = &'static str;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a key")
    }

    fn visit_str<E: Error>(self, key: &str) -> Result<&'static str, E> {
        self.0
            .iter()
            .find(|known| **known == key)
            .copied()
            .ok_or_else(|| E::unknown_field(key, self.0))
    }
}

/// Declares a struct of parameters: see [the module](mod@crate::parameters).
#[macro_export]
macro_rules! parameters {
    (@unit) => { $crate::parameters::Unit::ONE };
    (@unit $unit:ident) => { $crate::parameters::Unit::$unit };
    (@range) => { None };
    (@range $low:literal $high:literal) => { Some([$low as f64, $high as f64]) };
    (@or) => { "" };
    (@or $text:literal) => { $text };
    (@default ($default:expr) ($type:ty)) => { $default };
    (@default ($default:expr) ($type:ty) [$($unit:ident)?]) => {
        <$type as $crate::parameters::Value>::of($default, $crate::parameters!(@unit $($unit)?))
    };
    (
        $(#[$meta:meta])*
        pub struct $Name:ident in $section:literal {
            $(
                $(#[doc = $doc:literal])*
                $field:ident: $type:ty = $default:expr
                $(, $key:literal $([$unit:ident, $low:literal, $high:literal $(, $hint:literal)?])? $(like $example:literal)?)?;
            )*
        }
        $(with { $($(#[doc = $part_doc:literal])* $part:ident: $Part:ty),* $(,)? })?
        $(check $together:path;)?
    ) => {
        $(#[$meta])*
        pub struct $Name {
            $(
                $(#[doc = $doc])*
                $(#[doc = concat!("\n\n`", $section, ".", $key, "`, default ", stringify!($default))])?
                pub $field: $type,
            )*
            $($($(#[doc = $part_doc])* pub $part: $Part,)*)?
        }

        impl Default for $Name {
            fn default() -> Self {
                Self {
                    $($field: $crate::parameters!(@default ($default) ($type) $([$($unit)?])?),)*
                    $($($part: Default::default(),)*)?
                }
            }
        }

        impl $Name {
            /// Refuses the first parameter outside its range.
            ///
            /// # Errors
            /// A number outside its range, by its key.
            pub fn check(&self) -> Result<(), $crate::parameters::SettingError> {
                #[allow(unused_variables)]
                let declared = <Self as $crate::parameters::Section>::parameters();
                $($($crate::parameters::check(&self.$field, $key, &declared)?;)?)*
                $($(self.$part.check()?;)*)?
                $($together(self)?;)?
                Ok(())
            }
        }

        impl $crate::parameters::Section for $Name {
            const NAME: &'static str = $section;

            fn keys() -> &'static [&'static str] {
                static KEYS: ::std::sync::LazyLock<Vec<&'static str>> = ::std::sync::LazyLock::new(|| {
                    <$Name as $crate::parameters::Section>::parameters().iter().map(|one| one.key).collect()
                });
                &KEYS
            }

            #[allow(unused_mut, unused_variables)]
            fn parameters() -> Vec<$crate::parameters::Parameter> {
                let (this, mut all) = (Self::default(), Vec::new());
                $(
                    let doc: &'static [&'static str] = &[$($doc),*];
                    $(all.push($crate::parameters::Parameter {
                        section: $section,
                        key: $key,
                        unit: $crate::parameters!(@unit $($unit)?),
                        range: $crate::parameters!(@range $($low $high)?),
                        hint: $crate::parameters!(@or $($($hint)?)?),
                        words: <$type as $crate::parameters::Value>::WORDS,
                        default: $crate::parameters::Value::yaml(&this.$field, $crate::parameters!(@unit $($unit)?)),
                        example: $crate::parameters!(@or $($example)?),
                        doc,
                        is_section: <$type as $crate::parameters::Value>::IS_SECTION,
                        is_list: <$type as $crate::parameters::Value>::IS_LIST,
                        inner: <$type as $crate::parameters::Value>::inner(),
                    });)?
                )*
                $($(all.extend(<$Part as $crate::parameters::Section>::parameters());)*)?
                all
            }

            #[allow(unused_variables)]
            fn read_key<'de, A: ::serde::de::MapAccess<'de>>(&mut self, key: &str, map: &mut A) -> Result<bool, A::Error> {
                match key {
                    $($(
                        $key => {
                            let (written, unit) = (map.next_value()?, $crate::parameters!(@unit $($unit)?));
                            self.$field = <$type as $crate::parameters::Value>::given(written, unit);
                        }
                    )?)*
                    _ => return Ok(false $($(|| $crate::parameters::Section::read_key(&mut self.$part, key, map)?)*)?),
                }
                #[allow(unreachable_code)]
                Ok(true)
            }
        }

        impl<'de> ::serde::Deserialize<'de> for $Name {
            fn deserialize<D: ::serde::Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
                $crate::parameters::read_section(deserializer)
            }
        }

        impl $crate::parameters::Value for $Name {
            type Written = $crate::parameters::WrittenSection<Self>;
            const IS_SECTION: bool = true;

            fn of(written: Self::Written, _: $crate::parameters::Unit) -> Self {
                match written {
                    $crate::parameters::WrittenSection::Keys(section) => section,
                    $crate::parameters::WrittenSection::Off => Self::default(),
                }
            }

            fn is_off(written: &Self::Written) -> bool {
                matches!(written, $crate::parameters::WrittenSection::Off)
            }

            #[allow(unused_variables)]
            fn set<'de, D: ::serde::Deserializer<'de>>(
                &mut self,
                path: &[&str],
                written: D,
                _: $crate::parameters::Unit,
            ) -> Result<(), D::Error> {
                let (key, below) = path.split_first().unwrap_or((&"", &[]));
                match *key {
                    $($($key => $crate::parameters::Value::set(
                        &mut self.$field,
                        below,
                        written,
                        $crate::parameters!(@unit $($unit)?),
                    ),)?)*
                    $($(key if <$Part as $crate::parameters::Section>::keys().contains(&key) => {
                        $crate::parameters::Value::set(&mut self.$part, path, written, $crate::parameters::Unit::ONE)
                    })*)?
                    key => Err(::serde::de::Error::unknown_field(
                        key,
                        <Self as $crate::parameters::Section>::keys(),
                    )),
                }
            }

            fn yaml(&self, _: $crate::parameters::Unit) -> Option<String> {
                Some(String::new())
            }

            fn named() -> Option<Self> {
                Some(Self::default())
            }

            fn check(&self) -> Result<(), $crate::parameters::SettingError> {
                $Name::check(self)
            }

            fn inner() -> Vec<$crate::parameters::Parameter> {
                <Self as $crate::parameters::Section>::parameters()
            }
        }
    };
}

/// Declares an enum whose variants have names: `ALL`, `name`, `of_name`, `Display`
/// and `FromStr`.
#[macro_export]
macro_rules! names {
    (
        $(#[$meta:meta])*
        pub enum $Name:ident { $($(#[$one_meta:meta])* $One:ident = $name:literal),* $(,)? }
    ) => {
        $(#[$meta])*
        pub enum $Name {
            $($(#[$one_meta])* $One,)*
        }

        impl $Name {
            /// All variants, in order.
            pub const ALL: [Self; [$($name),*].len()] = [$(Self::$One),*];

            /// Name in files and for display.
            pub const fn name(self) -> &'static str {
                match self {
                    $(Self::$One => $name,)*
                }
            }

            /// Variant of this name.
            pub fn of_name(name: &str) -> Option<Self> {
                Self::ALL.into_iter().find(|one| one.name() == name)
            }
        }

        impl ::std::fmt::Display for $Name {
            fn fmt(&self, f: &mut ::std::fmt::Formatter<'_>) -> ::std::fmt::Result {
                f.write_str(self.name())
            }
        }

        impl ::std::str::FromStr for $Name {
            type Err = String;

            fn from_str(name: &str) -> Result<Self, String> {
                let all = || Self::ALL.map(Self::name).join(", ");
                Self::of_name(name).ok_or_else(|| format!("take one of {}", all()))
            }
        }
    };
}

/// Declares an enum of the words allowed for a key, by [`names!`](crate::names!).
///
/// ```
/// touchup_method::words! {
///     /// Sense of a turn.
///     #[derive(Clone, Copy, Debug, Default, PartialEq)]
///     pub enum Turn {
///         /// As the clock does.
///         #[default]
///         Clockwise = "cw",
///         /// The other one.
///         Counter = "ccw",
///     }
/// }
/// assert_eq!(Turn::default().name(), "cw");
/// ```
#[macro_export]
macro_rules! words {
    (
        $(#[$meta:meta])*
        pub enum $Name:ident { $($(#[$word_meta:meta])* $Word:ident = $word:literal),* $(,)? }
    ) => {
        $crate::names! {
            $(#[$meta])*
            #[derive(::serde::Deserialize)]
            pub enum $Name {
                $($(#[$word_meta])* #[serde(rename = $word)] $Word = $word,)*
            }
        }

        impl $crate::parameters::Value for $Name {
            type Written = Self;
            const WORDS: &'static [&'static str] = &[$($word),*];

            fn of(written: Self, _: $crate::parameters::Unit) -> Self {
                written
            }

            fn yaml(&self, _: $crate::parameters::Unit) -> Option<String> {
                Some(self.name().to_owned())
            }
        }
    };
}
