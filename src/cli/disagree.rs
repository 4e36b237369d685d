//! `touchup disagree`: regions with a scan/touch discrepancy, and its cause: scanner, part or
//! touch.

use std::fmt;
use std::path::{Path, PathBuf};

use clap::Args;
use nalgebra::Vector3;

use super::common::pictures::{ViewFlag, file_name, today, write_coloured, write_picture};
use super::common::progress::WorkProgress;
use super::{CliError, Losses, check_outputs, counted, print_report, reported};
use touchup_features::compare::{
    BadTouches, Class, Disagreement, DisagreementRegion, IndexedMesh, PicturePanel, PictureParams,
    RefinedShape, RigidOffset, Scanner, VertexBasis, colour_of_class, disagreement,
};
use touchup_geometry::mesh::{FaceTree, TriMesh};
use touchup_io::mesh_file::{MeshUnit, VertexColumn, read_vertex_columns};
use touchup_io::touches_file::read_touches;
use touchup_session::scan::read_scan;
use touchup_session::threads::Threads;

#[derive(Debug, Args)]
pub(super) struct DisagreeArguments {
    /// Scan before refinement: mesh (PLY, STL, OBJ) or point cloud (PLY, PCD, XYZ, E57)
    scan: PathBuf,
    /// Refined mesh: a PLY of refine, with touched vertices marked
    refined: PathBuf,
    /// Touches, as from refine --touches-out
    #[arg(long, value_name = "CSV")]
    touches: PathBuf,
    /// Unit of the coordinates in SCAN and REFINED
    #[arg(long, value_name = "U", default_value = "mm")]
    mesh_unit: MeshUnit,
    /// Writes REFINED with the colours of its classes and the columns `disagreement_mm` and `class`
    #[arg(long, value_name = "PLY")]
    coloured: Option<PathBuf>,
    /// Writes SCAN with the same colours and columns
    #[arg(long, value_name = "PLY")]
    coloured_scan: Option<PathBuf>,
    /// Writes a picture of REFINED, coloured by class, and by its disagreement with SCAN
    #[arg(long, value_name = "PNG")]
    picture: Option<PathBuf>,
    #[command(flatten)]
    view: ViewFlag,
    /// Prints one JSON object
    #[arg(long)]
    json: bool,
}

reported! {
    /// Output of `--json`.
    struct DisagreeReport, fn of(found: &Disagreement) {
        /// `null` if the touched area is too small for an error model of the scanner.
        scanner: Option<ScannerReport> = found.scanner.as_ref().map(ScannerReport::of),
        /// Rigid offset of the whole scan, subtracted before the classification.
        rigid_offset: Option<RigidOffsetReport> = found.rigid_offset.as_ref().map(RigidOffsetReport::of),
        classes: Vec<ClassReport> = Class::ALL.iter().enumerate().map(|(at, class)| ClassReport::of(found, at, class)).collect(),
        regions: Vec<DisagreementRow> = found.regions.iter().map(DisagreementRow::of).collect(),
        bad_touches: Vec<BadTouchReport> = found.bad_touches.iter().map(BadTouchReport::of).collect(),
    }
}

reported! {
    struct ScannerReport, fn of(scanner: &Scanner) {
        /// touch − scan on surface in good view of the scanner; negative: the scan is too large.
        offset_mm: f64 = scanner.offset * 1e3,
        noise_mm: f64 = scanner.noise * 1e3,
        correlation_mm: f64 = scanner.correlation * 1e3,
        edge_mm: f64 = scanner.edge * 1e3,
        sees_from_mm: f64 = scanner.sees_from * 1e3,
        places: usize = scanner.places,
    }
}

reported! {
    struct RigidOffsetReport, fn of(offset: &RigidOffset) {
        /// Shift of the scan onto the touches, at `center_mm`.
        shift_mm: [f64; 3] = (offset.shift * 1e3).into(),
        /// Rotation vector.
        turn_deg: [f64; 3] = offset.turn.map(f64::to_degrees).into(),
        /// Standard deviation on each axis.
        shift_std_mm: [f64; 3] = (offset.shift_sigma * 1e3).into(),
        /// Standard deviation about each axis.
        turn_std_deg: [f64; 3] = offset.turn_sigma.map(f64::to_degrees).into(),
        center_mm: [f64; 3] = (offset.centre.coords * 1e3).into(),
    }
}

reported! {
    struct ClassReport, fn of(found: &Disagreement, at: usize, known: &Class) {
        class: &'static str = known.name(),
        /// Number in the column `class`.
        number: usize = at,
        refined_mm2: f64 = found.refined.areas[at] * 1e6,
        scan_mm2: f64 = found.scan.areas[at] * 1e6,
    }
}

reported! {
    struct DisagreementRow, fn of(region: &DisagreementRegion) {
        class: &'static str = region.class.name(),
        center_mm: [f64; 3] = (region.centre.coords * 1e3).into(),
        area_mm2: f64 = region.area * 1e6,
        mean_mm: f64 = region.mean * 1e3,
        sigmas: f64 = region.evidence.sigmas,
        open_area_mm2: f64 = region.evidence.open_area * 1e6,
        correlation_lengths: f64 = region.evidence.lengths,
        passes: usize = region.evidence.passes,
        edge_share_of_rim: f64 = region.evidence.edges,
    }
}

reported! {
    struct BadTouchReport, fn of(bad: &BadTouches) {
        center_mm: [f64; 3] = (bad.centre.coords * 1e3).into(),
        touches: Vec<u32> = bad.touches.clone(),
        off_mm: f64 = bad.off * 1e3,
        sigmas: f64 = bad.sigmas,
        rejected: usize = bad.rejected,
        against: usize = bad.against,
    }
}

/// Runs `touchup disagree`: finds, and prints the result.
pub(super) fn disagree(arguments: &DisagreeArguments) -> Result<Losses, CliError> {
    arguments.check_outputs()?;
    let reading = WorkProgress::stage("read");
    let unit = arguments.mesh_unit;
    let [scan, refined] = [&arguments.scan, &arguments.refined].map(|path| read_scan(path, unit));
    let (scan, refined) = (scan?.mesh, refined?.mesh);
    let known = read_known(&arguments.refined, unit, &refined)?;
    let touches = read_touches(&arguments.touches)?;
    drop(reading);

    let measuring = WorkProgress::stage("compare");
    let [scan_tree, refined_tree] = [&scan, &refined].map(|mesh| FaceTree::new_by(mesh, &Threads));
    let shape = IndexedMesh {
        mesh: &refined,
        tree: &refined_tree,
    };
    let found = disagreement(
        IndexedMesh {
            mesh: &scan,
            tree: &scan_tree,
        },
        &RefinedShape {
            shape,
            known: &known,
        },
        &touches,
    )?;
    drop(measuring);
    arguments.draw(&refined, &found)?;
    for (path, mesh, map) in [
        (&arguments.coloured, &refined, &found.refined),
        (&arguments.coloured_scan, &scan, &found.scan),
    ] {
        let Some(path) = path else { continue };
        let colours: Vec<_> = map
            .classes
            .iter()
            .map(|&class| colour_of_class(class))
            .collect();
        let in_mm: Vec<f32> = map.disagreement.iter().map(|d| (d * 1e3) as f32).collect();
        let number: Vec<u8> = map.classes.iter().map(|&class| class as u8).collect();
        let columns = [
            VertexColumn {
                name: "disagreement_mm",
                values: in_mm.into(),
            },
            VertexColumn {
                name: "class",
                values: number.into(),
            },
        ];
        write_coloured(path, mesh, unit, &colours, columns)?;
    }
    let report = DisagreeReport::of(&found);
    print_report(arguments.json, &report, || report.to_string())?;
    Ok(Losses::new())
}

/// Support of each vertex.
fn read_known(path: &Path, unit: MeshUnit, mesh: &TriMesh) -> Result<Vec<VertexBasis>, CliError> {
    let [support] = read_vertex_columns(path, unit, mesh, ["support"])?;
    let why = format!(
        "{} does not say what was touched: give the PLY that refine wrote",
        path.display()
    );
    let whole = support.filter(|support| support.len() == mesh.vertex_slots());
    let support = whole.ok_or_else(|| CliError::usage(why))?;
    let known = |support: &f32| match *support {
        1.0 => VertexBasis::Touched,
        3.0 => VertexBasis::Unreachable,
        _ => VertexBasis::NotTouched,
    };
    Ok(support.iter().map(known).collect())
}

impl DisagreeArguments {
    /// Checks the outputs before the work begins.
    fn check_outputs(&self) -> Result<(), CliError> {
        let outputs = [
            ("--picture", ".png", &self.picture),
            ("--coloured", ".ply", &self.coloured),
            ("--coloured-scan", ".ply", &self.coloured_scan),
        ];
        check_outputs(
            &outputs,
            &[&self.scan, &self.refined, &self.touches].map(Some),
            "read",
        )?;
        self.view.direction().map(drop)
    }

    fn draw(&self, refined: &TriMesh, found: &Disagreement) -> Result<(), CliError> {
        let Some(path) = &self.picture else {
            return Ok(());
        };
        let _drawing = WorkProgress::stage("draw");
        let map = &found.refined;
        let is_touched = |class: &Class| !matches!(class, Class::NeverTouched | Class::Unreachable);
        let weights: Vec<f64> = map
            .classes
            .iter()
            .map(|class| if is_touched(class) { 1.0 } else { 0.0 })
            .collect();
        let range = found.scanner.map_or(1e-3, |scanner| {
            (4.0 * scanner.noise + scanner.offset.abs()).max(1e-6)
        });
        let panel = |classes, title| PicturePanel {
            deviations: &map.disagreement,
            classes,
            title,
            ..PicturePanel::of(refined)
        };
        let panels = [
            panel(Some(&map.classes[..]), "why"),
            panel(None, "touch - scan"),
        ];
        let [refined_name, scan_name] = [&self.refined, &self.scan].map(|path| file_name(path));
        let params = PictureParams {
            title: &format!("where {refined_name} and the scan {scan_name} disagree"),
            caption: &today(),
            range,
            from: self.view.direction()?,
            weights: Some(&weights),
            ..PictureParams::default()
        };
        write_picture(path, &panels, &params)
    }
}

/// Maximum number of listed regions and bad touches; `--json` has all.
const MOST_LISTED: usize = 12;

impl fmt::Display for DisagreeReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.write_scanner(f)?;
        self.write_classes(f)?;
        self.write_regions(f)?;
        self.write_bad_touches(f)
    }
}

impl DisagreeReport {
    /// Writes the errors of the scanner and the offset of the whole scan.
    fn write_scanner(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match &self.scanner {
            Some(ScannerReport {
                offset_mm,
                noise_mm,
                correlation_mm,
                edge_mm,
                sees_from_mm,
                places,
            }) => writeln!(
                f,
                "the scanner, by {} that it should see well: offset {offset_mm:+.3} mm, noise \
                 {noise_mm:.3} mm alike over {correlation_mm:.1} mm; edges of {edge_mm:.2} mm, so that what is narrower than \
                 {sees_from_mm:.1} mm may be closed over",
                counted(*places, "touched place", "touched places")
            )?,
            None => writeln!(
                f,
                "too little was touched to know how the scanner errs: nothing is called changed"
            )?,
        }
        if let Some(RigidOffsetReport {
            shift_mm: [x, y, z],
            turn_deg,
            ..
        }) = &self.rigid_offset
        {
            let turn = Vector3::from(*turn_deg).norm();
            writeln!(
                f,
                "the scan as a whole lies off by ({x:.3}, {y:.3}, {z:.3}) mm and {turn:.3}°, which is taken off"
            )?;
        }
        Ok(())
    }

    fn write_classes(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "{:<14} {:>12} {:>12}",
            "class", "refined, mm2", "scan, mm2"
        )?;
        for ClassReport {
            class,
            refined_mm2,
            scan_mm2,
            ..
        } in &self.classes
        {
            write!(f, "\n{class:<14} {refined_mm2:>12.1} {scan_mm2:>12.1}")?;
        }
        Ok(())
    }

    fn write_regions(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if !self.regions.is_empty() {
            write!(
                f,
                "\n{:<14} {:>24} {:>9} {:>9} {:>7} {:>8} {:>7} {:>9}",
                "region",
                "center, mm",
                "area, mm2",
                "mean, mm",
                "sigmas",
                "lengths",
                "passes",
                "at edges"
            )?;
        }
        for region in self.regions.iter().take(MOST_LISTED) {
            let [x, y, z] = region.center_mm;
            write!(
                f,
                "\n{:<14} {:>24} {:>9.1} {:>+9.3} {:>7.1} {:>8.1} {:>7} {:>7.0} %",
                region.class,
                format!("{x:.1} {y:.1} {z:.1}"),
                region.area_mm2,
                region.mean_mm,
                region.sigmas,
                region.correlation_lengths,
                region.passes,
                region.edge_share_of_rim * 100.0
            )?;
        }
        more(f, self.regions.len(), ["region", "regions"])
    }

    fn write_bad_touches(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for bad in self.bad_touches.iter().take(MOST_LISTED) {
            let ([x, y, z], touches) = (
                bad.center_mm,
                counted(bad.touches.len(), "touch", "touches"),
            );
            write!(
                f,
                "\nbad touch at ({x:.1}, {y:.1}, {z:.1}) mm: {:+.3} mm or {:.0} standard deviations off, {touches} from \
                 {} on, {} rejected, against {} nearby",
                bad.off_mm, bad.sigmas, bad.touches[0], bad.rejected, bad.against
            )?;
        }
        more(f, self.bad_touches.len(), ["bad touch", "bad touches"])
    }
}

fn more(f: &mut fmt::Formatter<'_>, count: usize, [one, many]: [&str; 2]) -> fmt::Result {
    match count.saturating_sub(MOST_LISTED) {
        0 => Ok(()),
        left => write!(
            f,
            "\n… and {left} more {}",
            if left == 1 { one } else { many }
        ),
    }
}
