//! Combinations of key values: a whole grid, or a sample.

use std::collections::BTreeMap;

use rand::{Rng, SeedableRng};
use rand_pcg::Pcg64;
use serde::Deserialize;
use serde_json::Value;

/// The value of each set key, by its path in the scene.
pub(super) type KeySetting = BTreeMap<String, Value>;

/// Division of a range.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub(super) enum RangeDivision {
    /// equal differences
    #[default]
    Linear,
    /// equal ratios
    Log,
}

/// The values of one key.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum KeyValues {
    /// successive values; a single one is the same in all jobs
    Listed(Vec<Value>),
    /// between two numbers, both included
    Range {
        from: f64,
        to: f64,
        steps: Option<u32>,
        scale: RangeDivision,
    },
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct WrittenRange {
    from: f64,
    to: f64,
    steps: Option<u32>,
    #[serde(default)]
    scale: RangeDivision,
}

/// Selection of settings.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase", deny_unknown_fields)]
pub(super) enum Sampling {
    /// every combination of the keys' values
    #[default]
    Grid,
    /// at random, each key independently
    Random {
        samples: u32,
        #[serde(default = "first_seed")]
        seed: u64,
    },
    /// points of Sobol's sequence, scrambled: evenly over the space of all keys
    Sobol {
        samples: u32,
        #[serde(default = "first_seed")]
        seed: u64,
    },
}

fn first_seed() -> u64 {
    1
}

/// Maximum length and dimensions of Sobol's sequence in the library.
const MOST_SOBOL: u32 = 1 << 16;
const MOST_DIMENSIONS: usize = sobol_burley::NUM_DIMENSIONS as usize;

impl KeyValues {
    /// Parses written values: a list, a range, or one value.
    pub fn of(written: Value) -> Result<Self, String> {
        match written {
            Value::Array(values) if values.is_empty() => {
                Err("the list is empty: give at least one value".to_owned())
            }
            Value::Array(values) => Ok(Self::Listed(values.into_iter().map(tidied).collect())),
            Value::Object(range) if range.contains_key("from") || range.contains_key("to") => {
                let range = serde_json::from_value(Value::Object(range))
                    .map_err(|error| error.to_string())?;
                let WrittenRange {
                    from,
                    to,
                    steps,
                    scale,
                } = range;
                let is_positive = from > 0.0 && to > 0.0;
                if !(from.is_finite() && to.is_finite()) {
                    return Err("from and to must be finite numbers".to_owned());
                }
                if scale == RangeDivision::Log && !is_positive {
                    return Err(format!(
                        "from {from} and to {to} must be above 0 on a scale of log"
                    ));
                }
                Ok(Self::Range {
                    from,
                    to,
                    steps,
                    scale,
                })
            }
            value => Ok(Self::Listed(vec![tidied(value)])),
        }
    }

    /// Number of values in a grid.
    fn count(&self) -> u64 {
        match self {
            Self::Listed(values) => values.len() as u64,
            Self::Range { steps, .. } => u64::from(steps.unwrap_or(1)),
        }
    }

    /// The value at an index of the grid.
    fn step(&self, at: u64) -> Value {
        match self {
            Self::Listed(values) => values.get(at as usize).cloned().unwrap_or_default(),
            Self::Range { steps, .. } => {
                let last = u64::from(steps.unwrap_or(2)).saturating_sub(1).max(1);
                self.at(at as f64 / last as f64)
            }
        }
    }

    /// The value at a share from 0 to 1 of the range.
    fn at(&self, share: f64) -> Value {
        match self {
            Self::Listed(values) => {
                let at = (share * values.len() as f64) as usize;
                values
                    .get(at.min(values.len() - 1))
                    .cloned()
                    .unwrap_or_default()
            }
            Self::Range { from, to, .. } if share <= 0.0 || from == to => number(*from),
            Self::Range { to, .. } if share >= 1.0 => number(*to),
            Self::Range {
                from,
                to,
                scale: RangeDivision::Linear,
                ..
            } => number(from + (to - from) * share),
            Self::Range {
                from,
                to,
                scale: RangeDivision::Log,
                ..
            } => number(from * (to / from).powf(share)),
        }
    }
}

/// A number with twelve digits, an integer if whole: the written text is the exact value.
fn number(x: f64) -> Value {
    let tidy: f64 = format!("{x:.11e}").parse().unwrap_or(x);
    if tidy.fract() == 0.0 && tidy.abs() < 1e15 {
        Value::from(tidy as i64)
    } else {
        Value::from(tidy)
    }
}

/// Numbers of a list as written, integers if whole.
fn tidied(value: Value) -> Value {
    match &value {
        Value::Number(written) => written
            .as_f64()
            .filter(|x| x.fract() == 0.0 && x.abs() < 1e15)
            .map_or(value, |x| Value::from(x as i64)),
        _ => value,
    }
}

impl Sampling {
    /// Refuses values unfit for this sampling.
    pub fn check(self, values: &KeyValues) -> Result<(), String> {
        match values {
            KeyValues::Range { steps: None, .. } if self == Self::Grid => {
                Err("a grid needs steps: { from: 1, to: 2, steps: 5 }".to_owned())
            }
            KeyValues::Range { steps: Some(_), .. } if self != Self::Grid => {
                Err("steps divide a range for a grid; here samples says how many there are: leave steps out".to_owned())
            }
            KeyValues::Range { steps: Some(0), .. } => Err("steps must be at least 1".to_owned()),
            KeyValues::Range { from, to, steps: Some(1), .. } if from != to => {
                Err("one step cannot be at both from and to: give steps: 2 or more".to_owned())
            }
            _ => Ok(()),
        }
    }

    /// Refuses sizes beyond the library.
    pub fn check_count(self, keys: &BTreeMap<String, KeyValues>) -> Result<(), String> {
        match self {
            Self::Sobol { samples, .. } if samples > MOST_SOBOL => Err(format!(
                "sampling.sobol.samples is {samples}; it must be 1 to {MOST_SOBOL}"
            )),
            Self::Sobol { .. } if keys.len() > MOST_DIMENSIONS => Err(format!(
                "sampling.sobol takes at most {MOST_DIMENSIONS} keys, and there are {}",
                keys.len()
            )),
            Self::Random { samples: 0, .. } | Self::Sobol { samples: 0, .. } => {
                Err("samples is 0; it must be at least 1".to_owned())
            }
            _ => Ok(()),
        }
    }

    /// Number of settings; `None` for an overflow.
    pub fn count(self, keys: &BTreeMap<String, KeyValues>) -> Option<u64> {
        match self {
            Self::Grid => keys
                .values()
                .try_fold(1_u64, |product, values| product.checked_mul(values.count())),
            Self::Random { samples, .. } | Self::Sobol { samples, .. } => Some(u64::from(samples)),
        }
    }

    /// One setting. In a grid the alphabetically last key changes first.
    pub fn setting(self, keys: &BTreeMap<String, KeyValues>, at: u64) -> KeySetting {
        match self {
            Self::Grid => {
                let mut left = at;
                let of_key = |(key, values): (&String, &KeyValues)| {
                    let step = left % values.count();
                    left /= values.count();
                    (key.clone(), values.step(step))
                };
                keys.iter().rev().map(of_key).collect()
            }
            Self::Random { seed, .. } => {
                let mut random = Pcg64::seed_from_u64(seed);
                random.advance(u128::from(at) * keys.len() as u128);
                let mut share = || (random.next_u64() >> 11) as f64 * (-53_f64).exp2();
                keys.iter()
                    .map(|(key, values)| (key.clone(), values.at(share())))
                    .collect()
            }
            Self::Sobol { seed, .. } => {
                let seed = (seed ^ (seed >> 32)) as u32;
                let share = |dimension| f64::from(sobol_burley::sample(at as u32, dimension, seed));
                let numbered = (0..).zip(keys);
                numbered
                    .map(|(dimension, (key, values))| (key.clone(), values.at(share(dimension))))
                    .collect()
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn keys(written: &str) -> BTreeMap<String, KeyValues> {
        let keys: BTreeMap<String, Value> = serde_saphyr::from_str(written).unwrap();
        keys.into_iter()
            .map(|(key, values)| (key, KeyValues::of(values).unwrap()))
            .collect()
    }

    fn all(sampling: Sampling, keys: &BTreeMap<String, KeyValues>) -> Vec<KeySetting> {
        (0..sampling.count(keys).unwrap())
            .map(|at| sampling.setting(keys, at))
            .collect()
    }

    /// Values by hand: fifths of 0.8 from 0.2, and a factor of ten per step.
    #[test]
    fn a_grid_has_every_value_with_every_other_one() {
        let keys = keys(
            "{ a: { from: 0.2, to: 1.0, steps: 5 }, b: [1, off], c: { from: 0.01, to: 10, steps: 4, scale: log } }",
        );
        let all = all(Sampling::Grid, &keys);
        assert_eq!(all.len(), 5 * 2 * 4);
        let column = |key: &str| {
            all.iter()
                .map(|setting| setting[key].to_string())
                .collect::<Vec<_>>()
        };
        let [a, c] = ["a", "c"].map(column);
        assert_eq!(
            [&a[0], &a[8], &a[16], &a[24], &a[32]],
            ["0.2", "0.4", "0.6", "0.8", "1"]
        );
        assert_eq!(c[..5], ["0.01", "0.1", "1", "10", "0.01"]);
        let distinct: std::collections::BTreeSet<_> =
            all.iter().map(|one| format!("{one:?}")).collect();
        assert_eq!(distinct.len(), 40);
    }

    /// Property of the sequence: each square of a 4 × 4 grid, and each sixteenth of an axis, holds
    /// one of 16 points.
    #[test]
    fn sobol_points_fill_the_square_evenly_whatever_the_seed() {
        let keys = keys("{ a: { from: 0, to: 16 }, b: { from: 0, to: 16 } }");
        for seed in [1, 2, 77] {
            let all = all(Sampling::Sobol { samples: 16, seed }, &keys);
            let place = |setting: &KeySetting, key: &str| setting[key].as_f64().unwrap();
            let counts = |cell: &dyn Fn(&KeySetting) -> (u64, u64)| {
                all.iter()
                    .map(cell)
                    .collect::<std::collections::BTreeSet<_>>()
                    .len()
            };
            assert_eq!(
                counts(&|one| (
                    (place(one, "a") / 4.0) as u64,
                    (place(one, "b") / 4.0) as u64
                )),
                16,
                "{seed}"
            );
            assert_eq!(counts(&|one| (place(one, "a") as u64, 0)), 16, "{seed}");
            assert_eq!(counts(&|one| (0, place(one, "b") as u64)), 16, "{seed}");
        }
    }

    #[test]
    fn random_settings_are_the_same_for_the_same_seed_and_within_their_ranges() {
        let keys =
            keys("{ a: { from: 2, to: 3 }, b: [x, y], c: { from: 1, to: 100, scale: log } }");
        let taken = |seed| all(Sampling::Random { samples: 200, seed }, &keys);
        let one = taken(1);
        assert_eq!(one, taken(1));
        assert_ne!(one, taken(2));
        assert!(
            one.iter()
                .all(|setting| (2.0..=3.0).contains(&setting["a"].as_f64().unwrap()))
        );
        // half of the samples each way, within five standard deviations of a fair coin: 100 ± 35
        let halves =
            |is: &dyn Fn(&KeySetting) -> bool| one.iter().filter(|setting| is(setting)).count();
        for count in [
            halves(&|one| one["b"] == "x"),
            halves(&|one| one["c"].as_f64().unwrap() < 10.0),
        ] {
            assert!((65..=135).contains(&count), "{count}");
        }
    }

    #[test]
    fn what_cannot_be_sampled_is_refused_with_what_to_do() {
        let of = |written: &str| KeyValues::of(serde_saphyr::from_str(written).unwrap());
        assert!(of("[]").unwrap_err().contains("empty"));
        assert!(
            of("{ from: 0, to: 1, scale: log }")
                .unwrap_err()
                .contains("above 0")
        );
        assert!(of("{ from: 0, till: 1 }").unwrap_err().contains("till"));
        assert!(
            Sampling::Grid
                .check(&of("{ from: 0, to: 1 }").unwrap())
                .unwrap_err()
                .contains("steps")
        );
        let with_steps = of("{ from: 0, to: 1, steps: 3 }").unwrap();
        assert!(
            Sampling::Random {
                samples: 8,
                seed: 1
            }
            .check(&with_steps)
            .unwrap_err()
            .contains("leave steps out")
        );
        assert!(
            Sampling::Sobol {
                samples: 65_537,
                seed: 1
            }
            .check_count(&BTreeMap::new())
            .is_err()
        );
        assert_eq!(of("7.0").unwrap(), KeyValues::Listed(vec![Value::from(7)]));
    }
}
