//! `touchup simulate --world`: calibration of a drawn world as a scene, and its truth.

use std::path::Path;
use std::str::FromStr;

use serde_json::{Value, json};

use super::CliError;
use super::common::output::write_json;
use touchup_io::atomic::write_atomically;
use touchup_sim::{DrawnValue, DrawnWorld, SimWorld, ToldOff};

/// Error factor for all calibrated values, or for one.
#[derive(Clone, Debug, PartialEq)]
pub struct OffFactor {
    quantity: Option<String>,
    factor: f64,
}

impl FromStr for OffFactor {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (quantity, number) = text
            .rsplit_once('=')
            .map_or((None, text), |(q, number)| (Some(q), number));
        let factor = number
            .parse()
            .map_err(|_| format!("{number} is no number: give 3, or radius=3"))?;
        let this = Self {
            quantity: quantity.map(str::to_owned),
            factor,
        };
        this.set(&mut ToldOff::all(1.0))?;
        Ok(this)
    }
}

impl OffFactor {
    /// Applies this factor.
    fn set(&self, off: &mut ToldOff) -> Result<(), String> {
        let place = match self.quantity.as_deref() {
            None => {
                *off = ToldOff::all(self.factor);
                return Ok(());
            }
            Some("radius") => &mut off.radius,
            Some("stiffness") => &mut off.stiffness,
            Some("tip-offset") => &mut off.tip_offset,
            Some("registration") => &mut off.registration,
            Some("clock") => &mut off.clock,
            Some("tare") => &mut off.tare,
            Some(other) => {
                let known = "radius, stiffness, tip-offset, registration, clock, tare";
                return Err(format!("{other} is none of {known}"));
            }
        };
        *place = self.factor;
        Ok(())
    }

    /// Combines factors; later ones override.
    pub fn joined(given: &[Self]) -> Result<ToldOff, CliError> {
        let mut off = ToldOff::all(1.0);
        for factor in given {
            factor.set(&mut off).map_err(CliError::usage)?;
        }
        Ok(off)
    }
}

/// World of a name.
///
/// # Errors
/// A text with the available names.
pub fn world_named(name: &str) -> Result<SimWorld, String> {
    name.parse()
        .map_err(|known| format!("there is no world {name}: {known}"))
}

/// Writes the calibrated scene: for `refine --scene`.
///
/// - `lever`: root mean square distance of the part from its origin, m.
pub(super) fn write_told_scene(
    drawn: &DrawnWorld,
    lever: f64,
    path: &Path,
) -> Result<(), CliError> {
    let text = drawn.told_scene(lever);
    write_atomically(path, |out| std::io::Write::write_all(out, text.as_bytes()))
        .map_err(super::not_written(path))
}

/// Writes each drawn value with its unit and its calibrated value; all in SI.
pub(super) fn write_truth(drawn: &DrawnWorld, path: &Path) -> Result<(), CliError> {
    let (told, sensor) = (&drawn.told, &drawn.stylus.sensor);
    let value = |v: &DrawnValue| {
        let told = v
            .told
            .map(|[told, std]| json!({ "value": told, "std": std }));
        (
            v.name.to_owned(),
            json!({ "unit": v.unit, "truth": v.truth, "range": v.range, "told": told }),
        )
    };
    let values: serde_json::Map<String, Value> = drawn.values.iter().map(value).collect();
    let place = |pose: &nalgebra::Isometry3<f64>| {
        let q = pose.rotation.coords;
        json!({ "position_m": pose.translation.vector.as_slice(), "orientation_xyzw": [q.x, q.y, q.z, q.w] })
    };
    let report = json!({
        "world": drawn.world.name(),
        "seed": drawn.seed,
        "habit": format!("{:?}", drawn.habit).to_lowercase(),
        "values": values,
        "tip_offset": { "unit": "m", "truth": sensor.tip_offset.as_slice(), "told": told.tip_offset.as_slice(),
            "std": told.stds.tip_offset },
        "tare": { "unit": "N", "truth": sensor.tare.as_slice(), "told": told.tare.as_slice(), "std": told.stds.tare },
        "scan_to_space": { "truth": place(&sensor.scan_to_space), "told": place(&told.scan_to_space),
            "shift_std_m": told.stds.shift, "turn_std_rad": told.stds.turn },
    });
    write_json(path, &report)
}
