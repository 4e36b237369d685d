//! The chapter: maps, tables and text.

use super::{FaceShares, LARGEST_SUB_FLOW_ERROR, MeshShares, RunEnding, Stability, count_of};
use crate::{Axis, Chapter, Drawing, Figure, Panel, Table, TableOf};
use touchup_core::haptic::GuardParams;

/// What of the runs the maps show.
const SHARE_OF: &str = "stable runs";
/// Endings with the heads of their columns.
const ENDINGS: [(RunEnding, &str); 7] = [
    (RunEnding::Stable, "stable, %"),
    (RunEnding::GaveUp, "gave up, %"),
    (RunEnding::NotFinite, "not finite, %"),
    (RunEnding::NotUnit, "not unit, %"),
    (RunEnding::Flipped, "flipped, %"),
    (RunEnding::Overshot, "overshot, %"),
    (RunEnding::CutBack, "cut back, %"),
];

impl Stability {
    /// The maps, the tables and their text.
    pub fn chapter(&self) -> Chapter {
        Chapter {
            title: "Stability".to_owned(),
            text: [vec![what_was_run(self)], verdicts(self)].concat(),
            figures: figures(self),
            tables: vec![faces_table(&self.faces), meshes_table(&self.meshes), sub_flows_table(self)],
        }
    }
}

fn percent(share: f64) -> String {
    // what is not all must not read as all
    if share == 1.0 { "100 %".to_owned() } else { format!("{:.2} %", (100.0 * share).min(99.99)) }
}

fn what_was_run(stability: &Stability) -> String {
    let counts = || stability.faces.iter().map(|shares| shares.runs);
    let (runs, fewest) = (counts().max().unwrap_or(0), counts().min().unwrap_or(0));
    format!(
        "One face and one held sample are drawn at random: h_min, f_max, alpha, beta and the step length each over twelve \
         decades, the force from a millionth of f_max to three times f_max and up to 78 degrees off the normal (what the \
         refiner lets act on a face), the tip near the face or anywhere within a metre. {runs} such runs of six steps ({fewest} \
         for the solver that takes long to give up). A run is stable when every step ends, stays finite, keeps |n| = 1 to 1e-9, \
         does not flip the normal, does not carry the face over its rest point and does not turn the normal past the force. \
         Euler and RK4 steps get their normal set to length 1 after each step, as anybody would do; how often that was \
         needed is a column of its own."
    )
}

fn verdicts(stability: &Stability) -> Vec<String> {
    let mut text: Vec<String> = stability.faces.iter().map(of_face).collect();
    text.extend(stability.meshes.iter().map(of_mesh));
    let worst = stability.largest_sub_flow_error();
    text.push(format!(
        "The exact sub-flows differ from the 32-digit solution by {worst:.1e} of their scale at most: {} the limit of {LARGEST_SUB_FLOW_ERROR:.0e}.",
        if worst <= LARGEST_SUB_FLOW_ERROR { "within" } else { "MISSES" }
    ));
    text.push(if stability.is_default_stable() {
        "One face: the integrator used by default (Lie, robust mode) was stable in every run.".to_owned()
    } else {
        "MISSED: the integrator used by default (Lie, robust mode) was not stable in every run; the tables show where."
            .to_owned()
    });
    text.push(of_default_on_meshes(stability));
    text
}

fn of_default_on_meshes(stability: &Stability) -> String {
    let (limit, share) = (GuardParams::default().smallest_quality, GuardParams::SCANNED_SHARE);
    if stability.meshes.iter().all(|shares| shares.stable_share == 1.0) {
        return "On meshes of any quality that was tried, the default was stable in every press.".to_owned();
    }
    let runs: usize = stability.meshes.iter().map(|shares| shares.runs).sum();
    let [cut_back, overshot] = [RunEnding::CutBack, RunEnding::Overshot]
        .map(|ending| stability.meshes.iter().map(|shares| count_of(&shares.endings, ending)).sum::<usize>());
    let from = match stability.default_stable_from_quality() {
        Some(quality) => format!("no press is at fault from an altitude of {quality:.2} of the longest side on"),
        None => "there are faults at every quality".to_owned(),
    };
    format!(
        "MISSED on bad triangles: {from}. Of {runs} presses {cut_back} were cut back, because the guard lets no triangle become \
         thinner than {limit}, or than {share} of what it was scanned with where that is less, nor turn too far or fold: the mesh \
         stays sound there, but does not follow the touch; remesh such a scan first. \
         In {overshot} the face went over its rest point."
    )
}

fn of_face(shares: &FaceShares) -> String {
    let limit = match shares.stable_up_to {
        _ if shares.stable_share == 1.0 => "no fault anywhere on the map".to_owned(),
        Some(limit) => format!("no fault below alpha f_max dt/h_min = {limit:.0e}"),
        None => "faults in every column of the map".to_owned(),
    };
    let (name, stable, runs) = (shares.integrator.name(), percent(shares.stable_share), shares.runs);
    format!("{name}: {stable} of {runs} runs are stable; {limit}.")
}

fn of_mesh(shares: &MeshShares) -> String {
    let (name, stable, runs) = (shares.shape.name(), percent(shares.stable_share), shares.runs);
    format!(
        "Refiner, {name}: {stable} of {runs} presses are stable, from equilateral triangles to an altitude of a thousandth of \
         the longest side."
    )
}

fn maps(panels: Vec<Panel>) -> Drawing {
    Drawing::Maps { share_of: SHARE_OF.to_owned(), panels }
}

fn figures(stability: &Stability) -> Vec<Figure> {
    let mut figures: Vec<Figure> = stability.faces.iter().map(stiffness_map).collect();
    figures.push(step_map(&stability.faces));
    figures.push(quality_map(&stability.meshes));
    figures
}

fn stiffness_map(shares: &FaceShares) -> Figure {
    let name = shares.integrator.name();
    Figure {
        id: format!("stability_{}", shares.integrator.id()),
        title: format!("Stable runs of one face: {name}"),
        caption: format!(
            "{} runs over twelve decades of h_min, f_max, alpha, beta and step length; {} stable. Cells at the rim hold what \
             lies beyond. For the spring f_max/h_min is its stiffness, and y the rate of turning times dt.",
            shares.runs,
            percent(shares.stable_share)
        ),
        x: Axis::log("stiffness of the position, alpha f_max dt/h_min", "alpha_f_max_dt_per_h_min"),
        y: Axis::log("stiffness of the normal, beta f_max² dt", "beta_f_max_squared_dt"),
        drawing: maps(shares.by_stiffness.to_vec()),
    }
}

fn step_map(faces: &[FaceShares]) -> Figure {
    Figure {
        id: "stability_step_length".to_owned(),
        title: "Stable runs of one face by step length and h_min".to_owned(),
        caption: "The same runs over the two quantities that a user chooses; f_max, alpha and beta over twelve decades in each cell."
            .to_owned(),
        x: Axis::log("step length, s", "step_s"),
        y: Axis::log("h_min, m", "h_min_m"),
        drawing: maps(faces.iter().map(|shares| shares.by_step.clone()).collect()),
    }
}

fn quality_map(meshes: &[MeshShares]) -> Figure {
    Figure {
        id: "stability_mesh_quality".to_owned(),
        title: "Stable presses on meshes of bad triangles".to_owned(),
        caption: "A ball of 1.5 mm presses with 2 N, up to 16 degrees off the normal, on a sheet of equal triangles with sides of \
                  0.3 to 10 mm; robust mode, alpha and sample time vary. An update that had to be cut back counts as unstable."
            .to_owned(),
        x: Axis::log("relaxation in one step, alpha k dt", "alpha_k_dt"),
        y: Axis::log("altitude over longest side", "altitude_per_longest_side"),
        drawing: maps(meshes.iter().map(|shares| shares.by_quality.clone()).collect()),
    }
}

/// How many runs there were, and how many percent of them ended in each way.
fn with_endings<'a, R: Copy>(table: TableOf<R>, of: fn(R) -> &'a [(RunEnding, usize)]) -> TableOf<R> {
    let runs = |row| of(row).iter().map(|(_, count)| count).sum::<usize>();
    ENDINGS.iter().fold(table.column("runs", runs), |table, (ending, head)| {
        table.column(*head, |row| 100.0 * count_of(of(row), *ending) as f64 / runs(row) as f64)
    })
}

fn faces_table(faces: &[FaceShares]) -> Table {
    let caption =
        "The first fault of a run counts. Last column: runs in which the integrator itself kept |n| = 1 to 1e-9.";
    let table = Table::of("stability_faces", "How the runs of one face ended", caption, faces)
        .column("integrator", |shares| shares.integrator.name());
    with_endings(table, |shares| &shares.endings)
        .column("kept |n| = 1 by itself, %", |shares| 100.0 * shares.unit_share)
        .table
}

fn meshes_table(meshes: &[MeshShares]) -> Table {
    let caption = "Robust mode, from equilateral triangles to an altitude of a thousandth of the longest side.";
    let table = Table::of("stability_meshes", "How the presses on meshes ended", caption, meshes)
        .column("triangles", |shares| shares.shape.name());
    with_endings(table, |shares| &shares.endings).table
}

fn sub_flows_table(stability: &Stability) -> Table {
    Table::of(
        "stability_sub_flows",
        "Exact sub-flows against their implicit closed form in 32 digits",
        format!(
            "Largest error over the scale: of a position h_min and the travel, of a normal 1. Limit {LARGEST_SUB_FLOW_ERROR:.0e}. Depths \
             up to 600 h_min, scaled times from 1e-6 to 1e6."
        ),
        &stability.sub_flows,
    )
    .column("sub-flow", |flow| flow.name.as_str())
    .column("cases", |flow| flow.cases)
    .column("largest error", |flow| flow.largest_error)
    .column("1e-10", |flow| if flow.largest_error <= LARGEST_SUB_FLOW_ERROR { "within" } else { "beyond" })
    .column("where", |flow| flow.worst.as_str())
    .table
}
