//! `touchup simulate --world`: what is told of a drawn world as a scene, and the truth beside it.

use std::path::Path;
use std::str::FromStr;

use serde_json::{Value, json};

use super::CliError;
use super::output::write_json;
use crate::io::atomic::write_atomically;
use crate::sim::{DrawnValue, DrawnWorld, SimWorld, ToldOff};

/// A factor for all that is told, or for one of it.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct OffFactor {
    quantity: Option<String>,
    factor: f64,
}

impl FromStr for OffFactor {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (quantity, number) = text.rsplit_once('=').map_or((None, text), |(q, number)| (Some(q), number));
        let factor = number.parse().map_err(|_| format!("{number} is no number: give 3, or radius=3"))?;
        let this = Self { quantity: quantity.map(str::to_owned), factor };
        this.set(&mut ToldOff::all(1.0))?;
        Ok(this)
    }
}

impl OffFactor {
    /// Sets what it says.
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

    /// The factors of all, one after another.
    pub fn joined(given: &[Self]) -> Result<ToldOff, CliError> {
        let mut off = ToldOff::all(1.0);
        for factor in given {
            factor.set(&mut off).map_err(CliError::usage)?;
        }
        Ok(off)
    }
}

/// Reads the name of a world.
pub(super) fn world_named(name: &str) -> Result<SimWorld, String> {
    let names = SimWorld::ALL.map(SimWorld::name).join(", ");
    SimWorld::named(name).ok_or_else(|| format!("there is no world {name}: take one of {names}"))
}

/// Writes the scene of what is told: for `refine --scene`.
///
/// - `lever`: root mean square distance of the part from its origin, m.
pub(super) fn write_told_scene(drawn: &DrawnWorld, lever: f64, path: &Path) -> Result<(), CliError> {
    let (told, sensor) = (&drawn.told, &drawn.stylus.sensor);
    let mm = |v: &[f64]| format!("{:?}", v.iter().map(|x| x * 1e3).collect::<Vec<_>>());
    let place = told.scan_to_space.translation.vector;
    let turn = told.scan_to_space.rotation.coords;
    // what a light force is told from: six deviations of the noise and what steps and play of the sensor add
    let on_n = 0.4f64.max(6.0 * sensor.force_noise + sensor.force_play + sensor.force_step);
    // … and what may be left of the zero
    let free_n = 0.15f64.max(3.0 * told.stds.tare + sensor.force_play + sensor.force_step);
    let gap_ms = 30f64.max(2.5e3 / sensor.pose_rate);
    let text = format!(
        "# What is told of world {world}, seed {seed}; truth.json has the truth beside it.\n\
         sync:\n  wrench_offset_ms: {offset}\n  largest_gap_ms: {gap_ms}\n\
         clock:\n\
         scan_to_space:\n  position_mm: {place}\n  orientation_xyzw: {turn:?}\n\
         compensation:\n  bias:\n    force_n: {tare:?}\n    torque_nm: [0, 0, 0]\n\
         bias_tracking:\n\
         contact:\n  on_n: {on_n}\n  off_n: {off_n}\n  free_n: {free_n}\n\
         tip:\n  offset_mm: {tip}\n  radius_mm: {radius}\n  stiffness_n_per_mm: {stiffness}\n\
         scan:\n  file: scan.ply\n  unit: mm\n  noise_mm: {noise}\n\
         sliding:\n\
         carve:\n  tolerance_mm: {tolerance}\n\
         guard:\npatch:\n\
         uncertainty:\n  calibration_mm: {calibration}\n  stiffness_percent: {stiffness_std}\n\
         refine:\n",
        world = drawn.world.name(),
        seed = drawn.seed,
        offset = told.wrench_clock * 1e3,
        place = mm(place.as_slice()),
        turn = [turn.x, turn.y, turn.z, turn.w],
        tare = [told.tare.x, told.tare.y, told.tare.z],
        off_n = 0.55 * on_n,
        tip = mm(told.tip_offset.as_slice()),
        radius = told.radius * 1e3,
        stiffness = told.stiffness / 1e3,
        noise = told.scan_noise * 1e3,
        tolerance = 1e3 * sensor.pose_noise.max(0.05e-3),
        calibration = told.calibration_std(lever) * 1e3,
        stiffness_std = told.stds.stiffness * 100.0,
    );
    write_atomically(path, |out| std::io::Write::write_all(out, text.as_bytes())).map_err(super::not_written(path))
}

/// Writes each drawn value with its unit, and what was told of it; all in SI.
pub(super) fn write_truth(drawn: &DrawnWorld, path: &Path) -> Result<(), CliError> {
    let (told, sensor) = (&drawn.told, &drawn.stylus.sensor);
    let value = |v: &DrawnValue| {
        let told = v.told.map(|[told, std]| json!({ "value": told, "std": std }));
        (v.name.to_owned(), json!({ "unit": v.unit, "truth": v.truth, "range": v.range, "told": told }))
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
