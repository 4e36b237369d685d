//! Axis extents: positions of values, and ticks.

use crate::figure::{Axis, Scale};
use crate::number::{fixed, power_of_ten, range, three_digits};

/// Most decades with a mark at each power, and gridlines at their ninths.
const DECADES_WITH_NINTHS: i32 = 4;
/// Most marks with a number on an axis of powers.
const MOST_POWERS: i32 = 9;
/// Approximate number of marks on an axis of differences.
const ABOUT: f64 = 6.0;
/// Powers of ten in full digits: 0.01 to 10000.
const WRITTEN_OUT: std::ops::RangeInclusive<i32> = -2..=4;

/// Extent of an axis, in the coordinate that is even along it: the value, or its decimal logarithm.
pub(super) struct AxisExtent {
    scale: Scale,
    low: f64,
    high: f64,
    /// whether the axis has numbers only at its ends and in the middle
    is_given: bool,
}

/// A mark on an axis.
#[derive(Debug)]
pub(super) struct Tick {
    /// 0 at the low end, 1 at the high end
    pub at: f64,
    /// empty: a gridline alone
    pub label: String,
}

impl AxisExtent {
    /// The ends of the axis, or a margin around `values`; ignores values without a place.
    pub fn around(axis: &Axis, values: impl Iterator<Item = f64>) -> Self {
        let scale = axis.scale;
        if let Some([low, high]) = axis.ends {
            return Self {
                scale,
                low,
                high,
                is_given: true,
            };
        }
        let (low, high) =
            range(values.filter_map(|value| even(scale, value))).unwrap_or((0.0, 1.0));
        let width = high - low;
        // a single value still needs an extent
        let least = if scale == Scale::Log {
            0.3
        } else {
            (0.1 * low.abs()).max(1e-300)
        };
        let room = if width > 0.05 * least {
            0.05 * width
        } else {
            least
        };
        let from_zero = scale == Scale::Linear && low >= 0.0 && low < 0.4 * high;
        Self {
            scale,
            low: if from_zero { 0.0 } else { low - room },
            high: high + room,
            is_given: false,
        }
    }

    /// 0 at the low end, 1 at the high end; `None` for a value that the axis cannot show.
    pub fn place(&self, value: f64) -> Option<f64> {
        even(self.scale, value).map(|even| (even - self.low) / (self.high - self.low))
    }

    /// Gridlines, from the low end on.
    pub fn ticks(&self) -> Vec<Tick> {
        let mut ticks = match self.scale {
            _ if self.is_given => self.end_ticks().into(),
            Scale::Linear => self.even_ticks(),
            Scale::Log => self.power_ticks(),
        };
        ticks.retain(|tick| (-1e-9..=1.0 + 1e-9).contains(&tick.at));
        ticks
    }

    /// Ticks at both ends and in the middle, to a hundredth of the extent.
    fn end_ticks(&self) -> [Tick; 3] {
        let digits = (1.0 - (self.high - self.low).log10().floor()).max(0.0) as usize;
        [self.low, (self.low + self.high) / 2.0, self.high]
            .map(|value| self.tick(value, fixed(value, digits)))
    }

    fn even_ticks(&self) -> Vec<Tick> {
        let step = nice_step((self.high - self.low) / ABOUT);
        let (first, last) = ((self.low / step).ceil(), (self.high / step).floor());
        let count = (last - first).clamp(0.0, 4.0 * ABOUT) as i32;
        let values = (0..=count).map(|i| (first + f64::from(i)) * step);
        values
            .map(|value| self.tick(value, three_digits(value)))
            .collect()
    }

    fn power_ticks(&self) -> Vec<Tick> {
        let (first, last) = (self.low.floor() as i32, self.high.ceil() as i32);
        let every = 1 + (last - first) / MOST_POWERS;
        let ends = [self.low.ceil() as i32, self.high.floor() as i32];
        let is_short = ends[1] <= ends[0];
        let are_written_out = is_short || ends.iter().all(|end| WRITTEN_OUT.contains(end));
        let most = if last - first > DECADES_WITH_NINTHS {
            1
        } else {
            9
        };
        let ninths = (first..=last).flat_map(|power| (1..=most).map(move |ninth| (power, ninth)));
        let tick = |(power, ninth): (i32, i32)| {
            let value = f64::from(ninth) * 10f64.powi(power);
            // below about one decade, 2 and 5 need their numbers too
            let label = match ninth {
                1 if power.rem_euclid(every) != 0 => String::new(),
                1 if !are_written_out => power_of_ten(power),
                1 => three_digits(value),
                2 | 5 if is_short => three_digits(value),
                _ => String::new(),
            };
            self.tick(value, label)
        };
        ninths.map(tick).collect()
    }

    fn tick(&self, value: f64, label: String) -> Tick {
        let label = label.replace('-', "−");
        Tick {
            at: self.place(value).unwrap_or(-1.0),
            label,
        }
    }
}

fn even(scale: Scale, value: f64) -> Option<f64> {
    let even = match scale {
        Scale::Linear => value,
        Scale::Log => value.log10(),
    };
    even.is_finite().then_some(even)
}

/// 1, 2 or 5 times a power of ten, at least `least`.
fn nice_step(least: f64) -> f64 {
    let power = 10f64.powf(least.log10().floor());
    let steps = [1.0, 2.0, 5.0, 10.0].map(|factor| factor * power);
    let step = steps.into_iter().find(|step| *step >= least * 0.999);
    step.filter(|step| step.is_finite() && *step > 0.0)
        .unwrap_or(1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn axis(scale: Scale) -> Axis {
        let scale = |axis| Axis { scale, ..axis };
        scale(Axis::linear("", ""))
    }

    fn labels(scale: Scale, values: &[f64]) -> Vec<String> {
        let ticks = AxisExtent::around(&axis(scale), values.iter().copied()).ticks();
        ticks
            .into_iter()
            .map(|tick| tick.label)
            .filter(|label| !label.is_empty())
            .collect()
    }

    #[test]
    fn marks_are_where_a_person_would_put_them() {
        assert_eq!(
            labels(Scale::Linear, &[0.0, 1.0]),
            ["0", "0.2", "0.4", "0.6", "0.8", "1"]
        );
        assert_eq!(labels(Scale::Log, &[0.1, 100.0]), ["0.1", "1", "10", "100"]);
        assert_eq!(
            labels(Scale::Log, &[1e-9, 1e-6]),
            ["10⁻⁹", "10⁻⁸", "10⁻⁷", "10⁻⁶"]
        );
        assert_eq!(labels(Scale::Log, &[1.5, 6.0]), ["2", "5"]);
        // every second power of 14
        assert_eq!(labels(Scale::Log, &[1e-14, 1.0]).len(), 8);
    }

    #[test]
    fn an_axis_between_two_values_has_numbers_at_both_and_in_the_middle() {
        let extent = AxisExtent::around(
            &axis(Scale::Linear).within([-180.0, 180.0]),
            [3.0].into_iter(),
        );
        let ticks = extent.ticks();
        let ticks = ticks.iter().map(|tick| (tick.at, tick.label.as_str()));
        assert_eq!(
            ticks.collect::<Vec<_>>(),
            [(0.0, "−180"), (0.5, "0"), (1.0, "180")]
        );
    }

    #[test]
    fn what_cannot_be_shown_has_no_place() {
        let extent = AxisExtent::around(
            &axis(Scale::Log),
            [0.0, -1.0, f64::NAN, f64::INFINITY, 1.0, 10.0].into_iter(),
        );
        assert!(
            [0.0, -1.0, f64::NAN, f64::INFINITY]
                .iter()
                .all(|value| extent.place(*value).is_none())
        );
        assert!((extent.place(10f64.sqrt()).unwrap() - 0.5).abs() < 1e-12);
        for values in [&[][..], &[0.0], &[5.0], &[f64::NAN], &[1e308, -1e308]] {
            for scale in [Scale::Linear, Scale::Log] {
                let ticks = AxisExtent::around(&axis(scale), values.iter().copied()).ticks();
                assert!(
                    ticks.len() < 100 && ticks.iter().all(|tick| tick.at.is_finite()),
                    "{values:?} {ticks:?}"
                );
            }
        }
    }
}
