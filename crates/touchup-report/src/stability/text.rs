//! The chapter: maps, tables and text.

use super::{
    BoundedStepError, EndingCounts, FaceShares, LARGEST_SUB_FLOW_ERROR, MeshShares, RunEnding,
    Stability,
};
use crate::{Axis, Chapter, Drawing, Figure, Panel, Table, TableOf};
use itertools::Itertools;
use touchup_method::haptic::GuardParams;
use touchup_method::haptic::RELATIVE_ERROR;

/// Quantity in the maps.
const SHARE_OF: &str = "stable runs";
impl Stability {
    /// The maps, the tables and their text.
    pub fn chapter(&self) -> Chapter {
        let figures = self
            .faces
            .iter()
            .map(stiffness_map)
            .chain([step_map(&self.faces), quality_map(&self.meshes)]);
        let tables = vec![
            faces_table(&self.faces),
            meshes_table(&self.meshes),
            sub_flows_table(self),
            bounded_steps_table(self),
        ];
        Chapter::of("Stability", texts(self), figures.collect(), tables)
    }
}

fn percent(share: f64) -> String {
    // a share below 1 must not read as 100 %
    if share == 1.0 {
        "100 %".to_owned()
    } else {
        format!("{:.2} %", (100.0 * share).min(99.99))
    }
}

/// "99.99 % of 12000".
fn stable_of(endings: &EndingCounts) -> String {
    format!("{} of {}", percent(endings.stable_share()), endings.runs())
}

fn texts(stability: &Stability) -> Vec<String> {
    let runs = stability.faces.iter().map(|shares| shares.endings.runs());
    let (fewest, runs) = runs.minmax().into_option().unwrap_or_default();
    let run = format!(
        "One face and one held sample are drawn at random: h_min, f_max, alpha, beta and the step length each over twelve \
         decades, the force from a millionth of f_max to three times f_max and up to 78 degrees off the normal (what the \
         refiner lets act on a face), the tip near the face or anywhere within a metre. {runs} such runs of six steps ({fewest} \
         for the solver that takes long to give up). A run is stable when every step ends, stays finite, keeps |n| = 1 to 1e-9, \
         does not flip the normal, does not carry the face over its rest point and does not turn the normal past the force. \
         Euler and RK4 steps get their normal set to length 1 after each step, as anybody would do; how often that was \
         needed is a column of its own."
    );
    let worst = stability.largest_sub_flow_error();
    let verdict = if worst <= LARGEST_SUB_FLOW_ERROR {
        "within"
    } else {
        "MISSES"
    };
    let sub_flows = format!(
        "The exact sub-flows differ from the 32-digit solution by {worst:.1e} of their scale at most: {verdict} the limit of {LARGEST_SUB_FLOW_ERROR:.0e}."
    );
    let default = if stability.is_default_stable() {
        "One face: the integrator used by default (Lie, robust mode) was stable in every run."
    } else {
        "MISSED: the integrator used by default (Lie, robust mode) was not stable in every run; the tables show where."
    };
    let verdicts = [
        sub_flows,
        of_bounded_steps(stability),
        default.to_owned(),
        of_default_on_meshes(stability),
    ];
    let faces = stability.faces.iter().map(of_face);
    let meshes = stability.meshes.iter().map(of_mesh);
    [run]
        .into_iter()
        .chain(faces)
        .chain(meshes)
        .chain(verdicts)
        .collect()
}

fn of_bounded_steps(stability: &Stability) -> String {
    let groups = &stability.bounded_steps;
    let sum = |of: fn(&BoundedStepError) -> usize| groups.iter().map(of).sum::<usize>();
    let largest = groups
        .iter()
        .map(|group| group.position.max(group.normal))
        .fold(0.0, f64::max);
    let (cases, refused) = (sum(|group| group.cases), sum(|group| group.refused));
    let rounded = sum(|group| group.ill_conditioned);
    let verdict = if stability.is_bound_kept() {
        "within"
    } else {
        "MISSES"
    };
    format!(
        "The step `bounded` solves position and normal together: on {cases} random stiff samples, at any angle of the force, its \
         error is {largest:.2} of its bound of {RELATIVE_ERROR:.0e} at most ({rounded} that roundings of the input move by more are compared \
         with what those do; {refused} refused): {verdict} the bound."
    )
}

fn bounded_steps_table(stability: &Stability) -> Table {
    Table::of("stability_bounded_steps", "The step with an error bound against 32 digits", &stability.bounded_steps)
        .column("samples", |group| group.name.as_str())
        .column("compared", |group| group.cases)
        .column("refused", |group| group.refused)
        .column("decided by roundings", |group| group.undetermined)
        .column("without a reference", |group| group.without_reference)
        .column("moved by roundings", |group| group.ill_conditioned)
        .column("position, over the bound", |group| group.position)
        .column("normal, over the bound", |group| group.normal)
        .column("where the larger was", |group| group.worst.as_str())
        .caption(format!(
            "Largest error over the bound: {RELATIVE_ERROR:.0e} of the farthest travel, and of 1 for the normal. h_min from 1 nm \
             to 1 mm, alpha f_max dt/h_min up to 1e9 (spring 1e5), beta f_max² dt up to 1e6 (spring 100), the force up to 160 \
             degrees off the normal (spring 75)."
        ))
}

fn of_default_on_meshes(stability: &Stability) -> String {
    let limit = GuardParams::default().smallest_quality;
    let share = GuardParams::SCANNED_SHARE;
    let endings = || stability.meshes.iter().map(|shares| &shares.endings);
    if endings().all(|endings| endings.stable_share() == 1.0) {
        return "On meshes of any quality that was tried, the default was stable in every press."
            .to_owned();
    }
    let runs: usize = endings().map(EndingCounts::runs).sum();
    let count = |ending| {
        endings()
            .map(|endings| endings.count(ending))
            .sum::<usize>()
    };
    let [cut_back, overshot] = [RunEnding::CutBack, RunEnding::Overshot].map(count);
    let from = stability.default_stable_from_quality();
    let from = from.map_or("there are faults at every quality".to_owned(), |quality| {
        format!("no press is at fault from an altitude of {quality:.2} of the longest side on")
    });
    format!(
        "MISSED on bad triangles: {from}. Of {runs} presses {cut_back} were cut back, because the guard lets no triangle become \
         thinner than {limit}, or than {share} of what it was scanned with where that is less, nor turn too far or fold: the mesh \
         stays sound there, but does not follow the touch; remesh such a scan first. \
         In {overshot} the face went over its rest point."
    )
}

fn of_face(shares: &FaceShares) -> String {
    let limit = match shares.stable_up_to {
        _ if shares.endings.stable_share() == 1.0 => "no fault anywhere on the map".to_owned(),
        Some(limit) => format!("no fault below alpha f_max dt/h_min = {limit:.0e}"),
        None => "faults in every column of the map".to_owned(),
    };
    let (name, stable) = (shares.integrator, stable_of(&shares.endings));
    format!("{name}: {stable} runs are stable; {limit}.")
}

fn of_mesh(shares: &MeshShares) -> String {
    let (shape, stable) = (shares.shape, stable_of(&shares.endings));
    format!(
        "Refiner, {shape}: {stable} presses are stable, from equilateral triangles to an altitude of a thousandth of the longest side."
    )
}

fn maps(panels: impl IntoIterator<Item = Panel>) -> Drawing {
    Drawing::Maps {
        share_of: SHARE_OF.to_owned(),
        panels: panels.into_iter().collect(),
    }
}

fn stiffness_map(shares: &FaceShares) -> Figure {
    let name = shares.integrator.name();
    Figure::of(format!("stability_{}", shares.integrator.id()), maps(shares.by_stiffness.clone()))
        .title(format!("Stable runs of one face: {name}"))
        .axes(
            Axis::log("stiffness of the position, alpha f_max dt/h_min", "alpha_f_max_dt_per_h_min"),
            Axis::log("stiffness of the normal, beta f_max² dt", "beta_f_max_squared_dt"),
        )
        .caption(format!(
            "{} runs over twelve decades of h_min, f_max, alpha, beta and step length; {} stable. Cells at the rim \
             hold what lies beyond. For the spring f_max/h_min is its stiffness, and y the rate of turning times dt.",
            shares.endings.runs(),
            percent(shares.endings.stable_share())
        ))
}

fn step_map(faces: &[FaceShares]) -> Figure {
    Figure::of("stability_step_length", maps(faces.iter().map(|shares| shares.by_step.clone())))
        .title("Stable runs of one face by step length and h_min")
        .axes(Axis::log("step length, s", "step_s"), Axis::log("h_min, m", "h_min_m"))
        .caption(
            "The same runs over the two quantities that a user chooses; f_max, alpha and beta over twelve decades in \
             each cell.",
        )
}

fn quality_map(meshes: &[MeshShares]) -> Figure {
    Figure::of("stability_mesh_quality", maps(meshes.iter().map(|shares| shares.by_quality.clone())))
        .title("Stable presses on meshes of bad triangles")
        .axes(
            Axis::log("relaxation in one step, alpha k dt", "alpha_k_dt"),
            Axis::log("altitude over longest side", "altitude_per_longest_side"),
        )
        .caption(
            "A ball of 1.5 mm presses with 2 N, up to 16 degrees off the normal, on a sheet of equal triangles with \
             sides of 0.3 to 10 mm; robust mode, alpha and sample time vary. An update that had to be cut back counts \
             as unstable.",
        )
}

/// Number of runs, and percentage of each ending.
fn with_endings<R: Copy>(table: TableOf<R>, of: fn(R) -> EndingCounts) -> TableOf<R> {
    RunEnding::ALL.into_iter().fold(
        table.column("runs", |row| of(row).runs()),
        |table, ending| {
            table.column(format!("{ending}, %"), |row| {
                100.0 * of(row).count(ending) as f64 / of(row).runs() as f64
            })
        },
    )
}

fn faces_table(faces: &[FaceShares]) -> Table {
    let table = Table::of("stability_faces", "How the runs of one face ended", faces)
        .column("integrator", |shares| shares.integrator.name());
    with_endings(table, |shares| shares.endings)
        .column("kept |n| = 1 by itself, %", |shares| 100.0 * shares.unit_share)
        .caption(
            "The first fault of a run counts. Last column: runs in which the integrator itself kept |n| = 1 to 1e-9.",
        )
}

fn meshes_table(meshes: &[MeshShares]) -> Table {
    let table = Table::of(
        "stability_meshes",
        "How the presses on meshes ended",
        meshes,
    );
    let table = table.column("triangles", |shares| shares.shape.name());
    with_endings(table, |shares| shares.endings)
        .caption("Robust mode, from equilateral triangles to an altitude of a thousandth of the longest side.")
}

fn sub_flows_table(stability: &Stability) -> Table {
    let title = "Exact sub-flows against their implicit closed form in 32 digits";
    let verdict = |error: f64| {
        if error <= LARGEST_SUB_FLOW_ERROR {
            "within"
        } else {
            "beyond"
        }
    };
    Table::of("stability_sub_flows", title, &stability.sub_flows)
        .column("sub-flow", |flow| flow.name.as_str())
        .column("cases", |flow| flow.cases)
        .column("largest error", |flow| flow.largest_error)
        .column("1e-10", |flow| verdict(flow.largest_error))
        .column("where", |flow| flow.worst.as_str())
        .caption(format!(
            "Largest error over the scale: of a position h_min and the travel, of a normal 1. Limit \
             {LARGEST_SUB_FLOW_ERROR:.0e}. Depths up to 600 h_min, scaled times from 1e-6 to 1e6."
        ))
}
