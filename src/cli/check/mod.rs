//! `touchup check`: accuracy test of an arm on one spot and on spheres of known diameter before it
//! measures a part.

mod report;

use std::path::{Path, PathBuf};
use std::time::SystemTime;

use clap::Args;
use nalgebra::{Point3, Vector3};

use super::probing::arm::{ArmArguments, Measurement, TouchesOutput};
use super::probing::{KeptMeasurements, check_temperature, metres, millimetres};
use super::{CliError, Losses, print_report, require, require_positive, write_json};
use report::SphereResults;
pub(super) use report::{CheckReport, Gates};
use touchup_features::calibrate::{ReferenceSphere, SphereReading, check_workspace};
use touchup_probing::execute::{Prober, Repeatability, SphereTouches, SpotError};
use touchup_session::scene::{CheckRecord, Scene};

/// Allowed number of touches; three are the minimum for both sides and a repeatability.
const TOUCHES: std::ops::RangeInclusive<usize> = 3..=100;
/// Diameters of spheres, m: a ball slips off smaller ones, an arm cannot reach around larger ones.
const DIAMETERS: std::ops::RangeInclusive<f64> = 3e-3..=100e-3;
/// Default number of touches of a spot.
pub(super) const SPOT_TOUCHES: usize = 10;

#[derive(Debug, Args)]
#[group(id = "places", required = true, multiple = true, args = ["spot", "spheres"])]
pub(super) struct CheckArguments {
    #[command(flatten)]
    arm: ArmArguments,
    /// The scene, with `robot` (config/probe.yaml is an example)
    #[arg(long, value_name = "YAML")]
    scene: PathBuf,
    /// Flat spot on the part, clear for 15 mm around, in the frame of the scan, mm
    #[arg(long, value_name = "X,Y,Z", allow_hyphen_values = true)]
    spot: Option<String>,
    /// Number of touches of the spot, from alternating sides
    #[arg(long, value_name = "N", default_value_t = SPOT_TOUCHES, requires = "spot")]
    touches: usize,
    /// Sphere of known diameter within 2 mm of a place in the frame of the scan, mm; free from
    /// above, its post below; repeat for each
    #[arg(
        long = "sphere",
        value_name = "X,Y,Z,DIAMETER",
        allow_hyphen_values = true
    )]
    spheres: Vec<String>,
    /// Standard uncertainty of the diameters, µm
    #[arg(long, value_name = "U", default_value_t = Gates::default().diameter_sigma_um)]
    diameter_sigma_um: f64,
    /// Gate: largest distance between two touches of the spot, µm
    #[arg(long, value_name = "G", default_value_t = Gates::default().spot_um)]
    gate_um: f64,
    /// Gate: largest error of a sphere over the workspace, and largest scatter of its centre over
    /// the probe's orientations, µm
    #[arg(long, value_name = "G", default_value_t = Gates::default().sphere_um)]
    sphere_gate_um: f64,
    /// Temperature of the cell, °C; default: robot.temperature_c of the scene
    #[arg(long, value_name = "T", allow_hyphen_values = true)]
    temperature_c: Option<f64>,
    /// Output: the record of this check, for robot.check of a scene
    #[arg(long, value_name = "JSON")]
    out: Option<PathBuf>,
    #[command(flatten)]
    output: TouchesOutput,
    /// Prints the result as one JSON object
    #[arg(long)]
    json: bool,
}

/// Touches of one spot, and of spheres.
pub(super) struct CheckedTouches {
    pub spot: Option<Repeatability>,
    pub spheres: Vec<SphereTouches>,
}

pub(super) fn check(arguments: &CheckArguments) -> Result<Losses, CliError> {
    let CheckArguments {
        arm,
        scene: path,
        temperature_c,
        out,
        output,
        json,
        ..
    } = arguments;
    let gates = arguments.gates()?;
    let spot = arguments
        .spot
        .as_ref()
        .map(|spot| spot_of(spot, arguments.touches))
        .transpose()?;
    let spheres = arguments
        .spheres
        .iter()
        .map(|text| sphere_of(text))
        .collect::<Result<Vec<_>, _>>()?;
    if let Some(temperature_c) = temperature_c {
        check_temperature(*temperature_c)?;
    }
    let scene = Scene::read(path)?;
    let kept = KeptMeasurements::Touches(output.touches_out.as_deref());
    let measurement = Measurement {
        stage: "touch",
        kept,
        spheres: &spheres,
    };
    let touch = |prober: &mut Prober<'_>| touched(prober, spot.as_ref(), &spheres);
    let (touches, _) = arm
        .cell
        .measure(arm.robot, path, measurement, |arm, _| Ok(arm), touch)?;
    let report = CheckReport::of(&touches, &spheres, &scene, *temperature_c, gates)?;
    if let Some(out) = out {
        write_json(out, &report)?;
    }
    print_report(*json, &report, || report.to_string())?;
    Ok(report.losses())
}

impl CheckArguments {
    fn gates(&self) -> Result<Gates, CliError> {
        let Self {
            gate_um,
            sphere_gate_um,
            diameter_sigma_um,
            ..
        } = *self;
        require_positive("--gate-um", gate_um)?;
        require_positive("--sphere-gate-um", sphere_gate_um)?;
        let is_allowed = (0.0..=1e3).contains(&diameter_sigma_um);
        require(
            is_allowed,
            format_args!("--diameter-sigma-um {diameter_sigma_um} must be 0 to 1000"),
        )?;
        Ok(Gates {
            spot_um: gate_um,
            sphere_um: sphere_gate_um,
            diameter_sigma_um,
        })
    }
}

/// Spot from the text X,Y,Z in mm, and its number of touches.
fn spot_of(text: &str, touches: usize) -> Result<(Point3<f64>, usize), CliError> {
    let place = Point3::from(millimetres("--spot", text)?);
    let (least, most) = (TOUCHES.start(), TOUCHES.end());
    require(
        TOUCHES.contains(&touches),
        format!("--touches {touches} must be {least} to {most}"),
    )?;
    Ok((place, touches))
}

/// Sphere from the text X,Y,Z,DIAMETER in mm.
fn sphere_of(text: &str) -> Result<ReferenceSphere, CliError> {
    let wrong = || {
        CliError::usage(format!(
            "--sphere {text} is not X,Y,Z,DIAMETER in mm, with a diameter of 3 to 100"
        ))
    };
    match metres(text).ok_or_else(wrong)?[..] {
        [x, y, z, diameter] if DIAMETERS.contains(&diameter) => Ok(ReferenceSphere {
            centre: Point3::new(x, y, z),
            radius: diameter / 2.0,
        }),
        _ => Err(wrong()),
    }
}

/// Touches a spot the given number of times, and then each sphere.
pub(super) fn touched(
    prober: &mut Prober<'_>,
    spot: Option<&(Point3<f64>, usize)>,
    spheres: &[ReferenceSphere],
) -> Result<CheckedTouches, CliError> {
    let spot = spot
        .map(|(place, count)| prober.repeat(place, *count))
        .transpose()?;
    let mut touches = CheckedTouches {
        spot,
        spheres: Vec::new(),
    };
    for (number, sphere) in (1..).zip(spheres) {
        let of_sphere =
            |error: SpotError| CliError::from(error).with(format_args!("that was sphere {number}"));
        touches
            .spheres
            .push(prober.touch_sphere(sphere).map_err(of_sphere)?);
    }
    Ok(touches)
}

/// Touches one spot repeatedly.
///
/// - `spot`: text X,Y,Z in mm.
pub(super) fn repeated(
    arm: &ArmArguments,
    scene: &Path,
    spot: &str,
    touches: usize,
    output: &TouchesOutput,
) -> Result<Repeatability, CliError> {
    let (place, touches) = spot_of(spot, touches)?;
    let ArmArguments { robot, cell } = arm;
    let kept = KeptMeasurements::Touches(output.touches_out.as_deref());
    let measurement = Measurement {
        stage: "touch",
        kept,
        spheres: &[],
    };
    let repeat = |prober: &mut Prober<'_>| prober.repeat(&place, touches);
    Ok(cell
        .measure(*robot, scene, measurement, |arm, _| Ok(arm), repeat)?
        .0)
}

/// Errors of the spheres over the workspace.
fn sphere_results(
    touches: &[SphereTouches],
    spheres: &[ReferenceSphere],
    registered_at: &Vector3<f64>,
    gates: Gates,
) -> Result<SphereResults, CliError> {
    let touched = touches.iter().enumerate();
    let readings = touched.flat_map(|(sphere, touched)| {
        touched.orientations.iter().map(move |one| SphereReading {
            sphere,
            centres: one.centres.clone(),
        })
    });
    let readings: Vec<_> = readings.collect();
    let sigma = gates.diameter_sigma_um * 1e-6;
    let found = check_workspace(spheres, &readings, registered_at, sigma).map_err(|error| {
        let mut unreached = touches.iter().flat_map(|touched| &touched.not_reached);
        match unreached.next() {
            Some(unreached) => CliError::arm(error).with(unreached),
            None => CliError::arm(error),
        }
    })?;
    Ok(SphereResults::of(&found, spheres, touches))
}

impl CheckReport {
    /// - `scene`: scene of the check; `temperature_c`: cell temperature, if not as in the scene.
    pub(super) fn of(
        touches: &CheckedTouches,
        spheres: &[ReferenceSphere],
        scene: &Scene,
        temperature_c: Option<f64>,
        gates: Gates,
    ) -> Result<Self, CliError> {
        let robot = scene
            .robot
            .as_ref()
            .ok_or_else(|| CliError::usage("the scene names no `robot`"))?;
        let shared = robot.pattern.shared;
        let results = if spheres.is_empty() {
            None
        } else {
            let found = sphere_results(&touches.spheres, spheres, &shared.registered_at, gates);
            Some(found?)
        };
        let temperature_c = temperature_c.or(robot.temperature_c);
        let record = CheckRecord::new(SystemTime::now(), &robot.model_name(), temperature_c);
        let told_mm = scene.tip.as_ref().map(|tip| tip.ball.radius * 1e3);
        let before = robot.check_record.as_ref();
        let before_sigma_mm = before
            .and_then(|before| before.tip_radius_sigma_mm)
            .unwrap_or(0.0);
        let radii = [
            ("the scene tells", told_mm, shared.radius * 1e3),
            (
                "the check before found",
                before.and_then(|before| before.tip_radius_mm),
                before_sigma_mm,
            ),
        ];
        Ok(Self::judged(
            record,
            touches.spot.as_ref(),
            results,
            gates,
            &radii,
        ))
    }
}
