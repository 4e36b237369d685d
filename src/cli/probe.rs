//! `touchup probe`: an arm probes flagged features by itself, without ROS.

use std::fmt;
use std::path::PathBuf;

use clap::Args;
use nalgebra::Point3;
use serde::Serialize;

use super::common::signals::StopSignals;
use super::common::told::ToldNumbers;
use super::probing::arm::{ArmArguments, RobotName};
use super::probing::{Probing, ProbingOutcome, ProbingSetup, flag_of, goals_of, millimetres};
use super::{CliError, Losses, counted, print_report, reported, require, require_positive};
use touchup_features::conformity::DecisionParams;
use touchup_probing::arm::{Arm, RequestLimits};
use touchup_probing::execute::{Flag, HeldBack, Plan, PlannedMotion};

#[derive(Debug, Args)]
pub(super) struct ProbeArguments {
    #[command(flatten)]
    arm: ArmArguments,
    /// The scene, with `robot` (config/probe.yaml is an example)
    #[arg(long, value_name = "YAML")]
    scene: PathBuf,
    /// Feature to probe, in the frame of the scan: KIND@X,Y,Z or KIND@X,Y,Z,RADIUS in mm; repeat
    /// for each
    #[arg(
        long = "feature",
        value_name = "FLAG",
        required = true,
        allow_hyphen_values = true
    )]
    features: Vec<String>,
    /// Search radius around a flag without RADIUS, mm
    #[arg(long, value_name = "R", default_value_t = 3.0)]
    search_radius_mm: f64,
    /// Target half width of the confidence interval of each dimension, at the confidence of the
    /// scene, mm
    #[arg(long, value_name = "T")]
    tolerance_mm: Option<f64>,
    /// Touches until each characteristic of a drawing passes or fails, instead of until each ± is
    /// small enough
    #[arg(long, value_name = "GOAL", value_parser = ["decided"], requires = "nominal", conflicts_with = "tolerance_mm")]
    until: Option<String>,
    /// Drawing for --until decided: nominal values and tolerances, CSV or JSON (docs/inspect.md)
    #[arg(long, value_name = "FILE", requires = "until")]
    nominal: Option<PathBuf>,
    /// Minimum probability of conformity for a pass, and of nonconformity for a fail, over all
    /// interim decisions together
    #[arg(long, value_name = "P", default_value_t = 0.95, requires = "until")]
    confidence: f64,
    /// Maximum number of touches of a feature
    #[arg(long, value_name = "N")]
    max_touches: Option<usize>,
    /// Largest force at the tip, N; at most as in the scene
    #[arg(long, value_name = "F")]
    max_force_n: Option<f64>,
    /// Longest time for a feature, s; at most as in the scene
    #[arg(long, value_name = "T")]
    max_duration_s: Option<f64>,
    /// Temperature of the cell, °C; the results state if the arm's check had another; default:
    /// robot.temperature_c of the scene
    #[arg(long, value_name = "T", allow_hyphen_values = true)]
    temperature_c: Option<f64>,
    /// Slides along walls and across rims of the found feature with constant force, to refine the
    /// mesh
    #[arg(long)]
    slide: bool,
    /// Plans, checks reach and paths, and draws the plan from the scene alone, without an arm
    #[arg(long)]
    dry_run: bool,
    /// Start of the ball in the plan of --dry-run, in the frame of the scan, mm; default: 40 mm
    /// above the scan
    #[arg(
        long,
        value_name = "X,Y,Z",
        requires = "dry_run",
        allow_hyphen_values = true
    )]
    from_mm: Option<String>,
    /// Continues an interrupted probing in the folder of --out: does not repeat finished features
    #[arg(long, conflicts_with = "dry_run")]
    resume: bool,
    /// Writes mesh and features despite sure findings in the arm's data (`touchup doctor`)
    #[arg(long, conflicts_with = "dry_run")]
    force: bool,
    /// Folder for plan.png, probing.json, probed_touches.jsonl, known_surfaces.jsonl, recording, probed.json,
    /// refined.ply, features.json, touches.csv, touches.png
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// Output: the faces of the refined mesh as a STEP file (AP242) for CAD programs, as of
    /// `touchup refine --step`
    #[arg(long, value_name = "STEP", conflicts_with = "dry_run")]
    step: Option<PathBuf>,
    /// Prints the result as one JSON object
    #[arg(long)]
    json: bool,
}

pub(super) fn probe(arguments: &ProbeArguments) -> Result<Losses, CliError> {
    let flags = arguments.flags()?;
    let ArmArguments { robot, cell } = &arguments.arm;
    let (scan, unit) = cell.scan(&arguments.scene)?;
    let probing = Probing {
        scene: &arguments.scene,
        scan: &scan,
        unit,
        flags: &flags,
        is_simulated: *robot == RobotName::Sim,
        is_forced: arguments.force,
        out: &arguments.out,
        step: arguments.step.as_deref(),
    };
    let mut ready = probing.ready()?;
    arguments.narrow(&mut ready, &flags)?;
    if arguments.dry_run || !ready.scene.allows_motion() {
        return arguments.plan_alone(&probing, &ready);
    }
    if !arguments.resume {
        probing.check_free()?;
    }
    let signals = StopSignals::listen()?;
    cell.with(*robot, &ready, Ok, |arm| {
        arguments.run(&probing, &ready, arm, &signals)
    })
}

impl ProbeArguments {
    fn flags(&self) -> Result<Vec<Flag>, CliError> {
        let radius = self.search_radius_mm / 1e3;
        require_positive("--search-radius-mm", self.search_radius_mm)?;
        (1..)
            .zip(&self.features)
            .map(|(id, text)| flag_of(id, text, radius))
            .collect()
    }

    /// Narrows the scene's limits to the request.
    fn narrow(&self, ready: &mut ProbingSetup, flags: &[Flag]) -> Result<(), CliError> {
        if let Some(temperature_c) = self.temperature_c {
            ready.at_temperature(temperature_c)?;
        }
        let by = RequestLimits {
            force: self.max_force_n,
            time: self.max_duration_s,
            ..RequestLimits::default()
        };
        let wanted_mm = ready.tolerance_mm();
        ready.params = ready.params.narrowed(&by).map_err(CliError::usage)?;
        let params = &mut ready.params;
        params.slides = self.slide;
        if let Some(touches) = self.max_touches {
            let most = params.pattern.budget;
            let why = format!("--max-touches {touches} must be 1 to {most}, as the scene has it");
            require((1..=most).contains(&touches), why)?;
            params.pattern.budget = touches;
        }
        if let Some(tolerance_mm) = self.tolerance_mm {
            require_positive("--tolerance-mm", tolerance_mm)?;
            params.pattern.sigma *= tolerance_mm / wanted_mm;
        }
        if let Some(nominal) = &self.nominal {
            let is_more_than_even = self.confidence > 0.5 && self.confidence < 1.0;
            require(
                is_more_than_even,
                format_args!(
                    "--confidence {} must be above 0.5 and below 1",
                    self.confidence
                ),
            )?;
            let rule = DecisionParams {
                confidence: self.confidence,
                ..DecisionParams::default()
            };
            ready.params.goals = goals_of(nominal, flags, &ready.static_world()?, rule)?;
        }
        Ok(())
    }

    /// Plans without an arm, from `--from-mm` on.
    fn plan_alone(&self, probing: &Probing<'_>, ready: &ProbingSetup) -> Result<Losses, CliError> {
        let from = self
            .from_mm
            .as_ref()
            .map(|text| millimetres("--from-mm", text))
            .transpose()?;
        let (pose_bt, place) = ready.start(from.map(Point3::from));
        let [x, y, z] = (place * 1e3).coords.into();
        let why = || {
            format!(
                "the arm does not reach ({x:.1} {y:.1} {z:.1}) mm, where the plan begins: name a place by --from-mm"
            )
        };
        let now = ready
            .cell
            .at_rest(&pose_bt)
            .ok_or_else(|| CliError::usage(why()))?;
        let plans = probing.planned(ready, &now)?;
        if !self.dry_run {
            return ready.may_move().map(|()| Losses::new());
        }
        let picture = self.out.join("plan.png");
        let report = DryRunReport::of(
            &ready.told,
            probing.flags,
            &plans,
            [x, y, z],
            self.nominal.is_some(),
            picture,
        );
        print_report(self.json, &report, || report.to_string())?;
        Ok(Losses::new())
    }

    fn run(
        &self,
        probing: &Probing<'_>,
        ready: &ProbingSetup,
        arm: &mut dyn Arm,
        signals: &StopSignals,
    ) -> Result<Losses, CliError> {
        let now = arm.next_state().map_err(CliError::arm)?;
        probing.planned(ready, &now)?;
        let ProbingOutcome {
            summary, outcome, ..
        } = probing.done(ready, arm, self.resume, signals)?;
        print_report(self.json, &summary, || {
            let names = ["plan.png", "touches.png", "probed.json"];
            let are_all = summary.refine.is_some();
            let written = names
                .iter()
                .filter(|name| are_all || **name != "touches.png");
            let files: Vec<_> = written
                .map(|name| self.out.join(name).display().to_string())
                .collect();
            format!("{summary}\nwrote {}", files.join(", "))
        })?;
        outcome
    }
}

/// Assumption of a plan with decisions, which depend on the measurements.
const AS_SCANNED: &str = "the part is as the scan has it: a value nearer to its limits takes more touches until it is decided";

reported! {
    /// Output of `--dry-run --json`.
    struct DryRunReport, fn of(numbers: &ToldNumbers, flags: &[Flag], plans: &[Plan], start_mm: [f64; 3], decides: bool, drawn: PathBuf) {
        /// Settings of tip and scan, and their sources.
        told: ToldNumbers = numbers.clone(),
        /// Centre of the ball at the start of the plan, in the frame of the scan.
        from_mm: [f64; 3] = start_mm,
        features: Vec<PlannedFeature> =
            flags.iter().zip(plans).map(|(flag, plan)| PlannedFeature::of(flag.id, plan)).collect(),
        /// Assumption of the plan.
        assumes?: &'static str = decides.then_some(AS_SCANNED),
        picture: PathBuf = drawn,
    }
}

reported! {
    /// Plan for one flag.
    struct PlannedFeature, fn of(id: u32, plan: &Plan) {
        flag: u32 = id,
        touches: usize = plan.touches.len(),
        unreachable_touches: Vec<Unreachable> = Unreachable::of(plan, |what| match what {
            PlannedMotion::Touch(number) => Some(number),
            PlannedMotion::Slide(_) => None,
        }),
        /// Omitted places: the scan has no part there.
        beside_the_part_mm: Vec<[f64; 3]> = plan.left_out.iter().map(|place| (place * 1e3).coords.into()).collect(),
        slides: usize = plan.slides.len(),
        unreachable_slides: Vec<Unreachable> = Unreachable::of(plan, |what| match what {
            PlannedMotion::Slide(number) => Some(number),
            PlannedMotion::Touch(_) => None,
        }),
    }
}

/// Infeasible touch or slide.
#[derive(Debug, Serialize)]
struct Unreachable {
    /// Index from 0.
    number: usize,
    reason: String,
}

impl Unreachable {
    /// - `number`: index of a motion of the wanted kind.
    fn of(plan: &Plan, number: impl Fn(PlannedMotion) -> Option<usize>) -> Vec<Self> {
        let unreachable = |HeldBack { what, why }: &HeldBack| {
            let (number, reason) = (number(*what)?, why.clone());
            Some(Self { number, reason })
        };
        plan.held_back.iter().filter_map(unreachable).collect()
    }
}

/// Verdict, then each feature and its infeasible motions.
impl fmt::Display for DryRunReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let sum =
            |count: fn(&PlannedFeature) -> usize| self.features.iter().map(count).sum::<usize>();
        let [touches, slides] = [sum(|one| one.touches), sum(|one| one.slides)];
        let touched = touches - sum(|one| one.unreachable_touches.len());
        write!(
            f,
            "{touched} of {}",
            counted(touches, "planned touch", "planned touches")
        )?;
        if slides > 0 {
            let made = slides - sum(|one| one.unreachable_slides.len());
            write!(f, " and {made} of {}", counted(slides, "slide", "slides"))?;
        }
        writeln!(f, " can be made; nothing moved")?;
        let [x, y, z] = self.from_mm;
        writeln!(
            f,
            "planned from ({x:.1} {y:.1} {z:.1}) mm by the scene alone, without asking an arm where it is"
        )?;
        writeln!(f, "{}", self.told)?;
        self.assumes
            .iter()
            .try_for_each(|assumes| writeln!(f, "assumed: {assumes}"))?;
        for one in &self.features {
            write!(
                f,
                "feature {}: {}",
                one.flag,
                counted(one.touches, "touch", "touches")
            )?;
            if one.slides > 0 {
                write!(f, " and {}", counted(one.slides, "slide", "slides"))?;
            }
            let unreachable = one.unreachable_touches.len() + one.unreachable_slides.len();
            writeln!(f, " planned, {unreachable} cannot be made")?;
            if !one.beside_the_part_mm.is_empty() {
                let places = counted(one.beside_the_part_mm.len(), "place", "places");
                writeln!(f, "  {places} left out: the scan has no part there")?;
            }
            for (kind, unreachable) in [
                ("touch", &one.unreachable_touches),
                ("slide", &one.unreachable_slides),
            ] {
                for Unreachable { number, reason } in unreachable {
                    writeln!(f, "  {kind} {number}: {reason}")?;
                }
            }
        }
        write!(f, "wrote {}", self.picture.display())
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::{Point3, Vector3};

    use super::*;
    use touchup_probing::plan::TouchPlan;
    use touchup_session::scene::Scene;

    #[test]
    fn a_slide_that_cannot_be_made_is_no_touch() {
        let (entry, from) = (Point3::origin(), Point3::origin());
        let touch = TouchPlan {
            entry,
            from,
            direction: Vector3::z_axis(),
            search: 1e-3,
            expected: None,
        };
        let held_back = [
            (PlannedMotion::Touch(1), "reason 1"),
            (PlannedMotion::Slide(0), "reason 2"),
        ];
        let held_back = held_back
            .map(|(what, why)| HeldBack {
                what,
                why: why.to_owned(),
            })
            .to_vec();
        let plan = Plan {
            touches: vec![touch; 2],
            held_back,
            ..Plan::default()
        };
        let planned = PlannedFeature::of(7, &plan);
        let numbers = |unreachable: &[Unreachable]| -> Vec<(usize, String)> {
            unreachable
                .iter()
                .map(|one| (one.number, one.reason.clone()))
                .collect()
        };
        assert_eq!(
            numbers(&planned.unreachable_touches),
            [(1, "reason 1".to_owned())]
        );
        assert_eq!(
            numbers(&planned.unreachable_slides),
            [(0, "reason 2".to_owned())]
        );
        let told = ToldNumbers::of(&Scene::default(), "", [None; 3]);
        let features = vec![planned];
        let text = DryRunReport {
            told,
            from_mm: [0.0; 3],
            features,
            assumes: None,
            picture: PathBuf::from("plan.png"),
        }
        .to_string();
        assert!(
            text.starts_with("1 of 2 planned touches can be made; nothing moved\n"),
            "{text}"
        );
        assert!(
            text.contains("  touch 1: reason 1\n  slide 0: reason 2\n"),
            "{text}"
        );
    }
}
