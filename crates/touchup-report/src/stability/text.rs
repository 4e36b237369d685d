//! The chapter: maps, tables and text.

use super::{FaceShares, LARGEST_SUB_FLOW_ERROR, MeshShares, RunEnding, ShareMap, Stability};
use crate::{Axis, Chapter, Drawing, Figure, Panel, Table, TableCell};
use touchup_core::haptic::GuardParams;

/// What of the runs the maps show.
const SHARE_OF: &str = "stable runs";
/// Endings other than stable, with the heads of their columns.
const FAULTS: [(RunEnding, &str); 6] = [
    (RunEnding::GaveUp, "gave up, %"),
    (RunEnding::NotFinite, "not finite, %"),
    (RunEnding::NotUnit, "not unit, %"),
    (RunEnding::Flipped, "flipped, %"),
    (RunEnding::Overshot, "overshot, %"),
    (RunEnding::CutBack, "cut back, %"),
];

pub(super) fn chapter(stability: &Stability) -> Chapter {
    Chapter {
        title: "Stability".to_owned(),
        text: [vec![what_was_run(stability)], verdicts(stability)].concat(),
        figures: figures(stability),
        tables: vec![faces_table(&stability.faces), meshes_table(&stability.meshes), sub_flows_table(stability)],
    }
}

fn percent(share: f64) -> String {
    // what is not all must not read as all
    if share == 1.0 { "100 %".to_owned() } else { format!("{:.2} %", (100.0 * share).min(99.99)) }
}

fn what_was_run(stability: &Stability) -> String {
    let runs = stability.faces.iter().map(|shares| shares.runs).max().unwrap_or(0);
    let fewest = stability.faces.iter().map(|shares| shares.runs).min().unwrap_or(0);
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
    let count = |wanted| {
        let endings = stability.meshes.iter().flat_map(|shares| &shares.endings);
        endings.filter(|(ending, _)| *ending == wanted).map(|(_, count)| count).sum::<usize>()
    };
    let (runs, cut_back) =
        (stability.meshes.iter().map(|shares| shares.runs).sum::<usize>(), count(RunEnding::CutBack));
    let from = match stability.default_stable_from_quality() {
        Some(quality) => format!("no press is at fault from an altitude of {quality:.2} of the longest side on"),
        None => "there are faults at every quality".to_owned(),
    };
    format!(
        "MISSED on bad triangles: {from}. Of {runs} presses {cut_back} were cut back, because the guard lets no triangle become \
         thinner than {limit}, or than {share} of what it was scanned with where that is less, nor turn too far or fold: the mesh \
         stays sound there, but does not follow the touch; remesh such a scan first. \
         In {} the face went over its rest point.",
        count(RunEnding::Overshot)
    )
}

fn of_face(shares: &FaceShares) -> String {
    let limit = match shares.stable_up_to {
        _ if shares.stable_share == 1.0 => "no fault anywhere on the map".to_owned(),
        Some(limit) => format!("no fault below alpha f_max dt/h_min = {limit:.0e}"),
        None => "faults in every column of the map".to_owned(),
    };
    format!(
        "{}: {} of {} runs are stable; {limit}.",
        shares.integrator.name(),
        percent(shares.stable_share),
        shares.runs
    )
}

fn of_mesh(shares: &MeshShares) -> String {
    format!(
        "Refiner, {}: {} of {} presses are stable, from equilateral triangles to an altitude of a thousandth of the longest side.",
        shares.shape.name(),
        percent(shares.stable_share),
        shares.runs
    )
}

fn panel(name: &str, map: &ShareMap) -> Panel {
    Panel { name: name.to_owned(), xs: map.xs.clone(), ys: map.ys.clone(), shares: map.shares.clone() }
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
    let [sigmoid, spring] = &shares.by_stiffness;
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
        drawing: maps(vec![panel("sigmoid", sigmoid), panel("spring", spring)]),
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
        drawing: maps(faces.iter().map(|shares| panel(shares.integrator.name(), &shares.by_step)).collect()),
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
        drawing: maps(meshes.iter().map(|shares| panel(shares.shape.name(), &shares.by_quality)).collect()),
    }
}

/// Stable, then each fault, in percent of the runs.
fn shares_of(endings: &[(RunEnding, usize)], runs: usize) -> Vec<TableCell> {
    let of = |wanted: RunEnding| {
        let count = endings.iter().find(|(ending, _)| *ending == wanted).map_or(0, |(_, count)| *count);
        TableCell::Number(100.0 * count as f64 / runs as f64)
    };
    [RunEnding::Stable].into_iter().chain(FAULTS.map(|(ending, _)| ending)).map(of).collect()
}

fn heads(first: &[&str], last: &[&str]) -> Vec<String> {
    let faults = FAULTS.map(|(_, head)| head);
    [first, &["runs", "stable, %"], &faults, last].concat().into_iter().map(str::to_owned).collect()
}

fn faces_table(faces: &[FaceShares]) -> Table {
    let row = |shares: &FaceShares| {
        let mut row = vec![shares.integrator.name().into(), TableCell::Number(shares.runs as f64)];
        row.extend(shares_of(&shares.endings, shares.runs));
        row.push(TableCell::Number(100.0 * shares.unit_share));
        row
    };
    Table {
        id: "stability_faces".to_owned(),
        title: "How the runs of one face ended".to_owned(),
        caption:
            "The first fault of a run counts. Last column: runs in which the integrator itself kept |n| = 1 to 1e-9."
                .to_owned(),
        heads: heads(&["integrator"], &["kept |n| = 1 by itself, %"]),
        rows: faces.iter().map(row).collect(),
    }
}

fn meshes_table(meshes: &[MeshShares]) -> Table {
    let row = |shares: &MeshShares| {
        let mut row = vec![shares.shape.name().into(), TableCell::Number(shares.runs as f64)];
        row.extend(shares_of(&shares.endings, shares.runs));
        row
    };
    Table {
        id: "stability_meshes".to_owned(),
        title: "How the presses on meshes ended".to_owned(),
        caption: "Robust mode, from equilateral triangles to an altitude of a thousandth of the longest side."
            .to_owned(),
        heads: heads(&["triangles"], &[]),
        rows: meshes.iter().map(row).collect(),
    }
}

fn sub_flows_table(stability: &Stability) -> Table {
    let rows = stability.sub_flows.iter().map(|flow| {
        let verdict = if flow.largest_error <= LARGEST_SUB_FLOW_ERROR { "within" } else { "beyond" };
        vec![
            flow.name.clone().into(),
            TableCell::Number(flow.cases as f64),
            TableCell::Number(flow.largest_error),
            verdict.into(),
            flow.worst.clone().into(),
        ]
    });
    Table {
        id: "stability_sub_flows".to_owned(),
        title: "Exact sub-flows against their implicit closed form in 32 digits".to_owned(),
        caption: format!(
            "Largest error over the scale: of a position h_min and the travel, of a normal 1. Limit {LARGEST_SUB_FLOW_ERROR:.0e}. Depths \
             up to 600 h_min, scaled times from 1e-6 to 1e6."
        ),
        heads: ["sub-flow", "cases", "largest error", "1e-10", "where"].map(str::to_owned).to_vec(),
        rows: rows.collect(),
    }
}
