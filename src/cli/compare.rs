//! `touchup compare`: deviation of a mesh from the true part.

mod alignment;
mod table;

use std::path::{Path, PathBuf};

use clap::{Args, ValueEnum};
use nalgebra::{Isometry3, Point3};
use tracing::warn;

use self::alignment::{
    AlignmentReport, aligned_by_features, aligned_by_icp, aligned_by_pairs, moved,
};
use self::table::CompareReport;
pub use self::table::comparison_json;
use super::common::pictures::{ViewFlag, file_name, today, write_coloured, write_picture};
use super::common::progress::WorkProgress;
use super::{CliError, Losses, check_outputs, print_report, require};
use touchup_features::compare::{
    CompareParams, Comparison, IndexedMesh, PictureLabel, PicturePanel, PictureParams, Regions,
    SupportRegion, UnlikeExtents, colour_of, compare as compare_shapes,
};
use touchup_geometry::mesh::{FaceTree, TriMesh};
use touchup_io::features_file::{FeatureRecord, read_features};
use touchup_io::mesh_file::{MeshUnit, VertexColumn, read_vertex_columns};
use touchup_session::scan::{Scan, read_scan};
use touchup_session::session::ResultFiles;
use touchup_session::threads::Threads;

/// Tolerance in the picture of a folder, mm: medium of ISO 2768-1 for lengths of up to 6 mm.
const TOLERANCE_MM: f64 = 0.1;

/// Default number of sample points on the truth.
const SAMPLES: u32 = 200_000;

#[derive(Debug, Default, Args)]
#[command(mut_arg("view", |flag| flag.help("View direction of the picture, in the frame of TRUTH; default: the touched side")))]
pub(super) struct CompareArguments {
    /// Mesh (PLY, STL, OBJ) or point cloud (PLY, PCD, XYZ, E57) to compare; touched and untouched
    /// parts of a refined PLY get rows of their own
    mesh: PathBuf,
    /// The nominal or true part: PLY, STL or OBJ
    truth: PathBuf,
    /// With --align pairs: the same points on MESH (columns scan_x_mm and so on) and on TRUTH
    /// (space_x_mm and so on), as CSV
    #[arg(value_name = "PAIRS")]
    pairs: Option<PathBuf>,
    /// Unit of the coordinates in MESH, and in the mesh of --before
    #[arg(long, value_name = "U", default_value = "mm")]
    mesh_unit: MeshUnit,
    /// Unit of the coordinates in TRUTH
    #[arg(long, value_name = "U", default_value = "mm")]
    truth_unit: MeshUnit,
    /// The scan before its refinement, in the frame of MESH: compared beside it
    #[arg(long, value_name = "MESH")]
    before: Option<PathBuf>,
    /// Alignment of MESH to TRUTH
    #[arg(long, value_name = "HOW", default_value = "none")]
    align: Align,
    /// Number of the motion to use, if --align features finds several
    #[arg(long, value_name = "K", value_parser = clap::value_parser!(u16).range(1..))]
    alternative: Option<u16>,
    /// Writes a picture of MESH, coloured by deviation
    #[arg(long, value_name = "PNG")]
    picture: Option<PathBuf>,
    /// Writes MESH with these colours and the column `deviation_mm`, in its own frame and unit
    #[arg(long, value_name = "PLY")]
    coloured: Option<PathBuf>,
    /// Ends of the colours and of the histogram, mm; default: from the 95th percentile
    #[arg(long, value_name = "R", value_parser = positive)]
    range_mm: Option<f64>,
    /// Tolerance for the deviations: lists the share within it, and gives it one colour in the
    /// picture
    #[arg(long, value_name = "T", value_parser = positive)]
    tolerance_mm: Option<f64>,
    /// Features to name in the picture (holes, slots, pockets, bosses), in the frame of MESH, as
    /// `refine` writes them
    #[arg(long, value_name = "JSON", requires = "picture")]
    features: Option<PathBuf>,
    /// Further features to name in the picture.
    #[arg(skip)]
    named: Vec<FeatureRecord>,
    #[command(flatten)]
    view: ViewFlag,
    /// Number of points spread over TRUTH; MESH gets the same density
    #[arg(long, value_name = "N", default_value_t = SAMPLES, value_parser = clap::value_parser!(u32).range(100..=5_000_000))]
    samples: u32,
    /// Seed of the spread points
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    /// Also prints the sizes of both, the table of all distances, and the points of the alignment
    #[arg(long, short)]
    verbose: bool,
    /// Prints one JSON object
    #[arg(long)]
    json: bool,
}

/// Method of aligning the mesh to the truth.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
enum Align {
    /// MESH is already aligned
    #[default]
    None,
    /// Point to plane, from an approximate alignment
    Icp,
    /// Holes, slots, corners and planes, from any start, then point to plane
    Features,
    /// Picked point pairs of the file PAIRS
    Pairs,
}

/// Mesh in the frame of the truth, with its tree.
struct PlacedMesh {
    mesh: TriMesh,
    tree: FaceTree,
}

impl PlacedMesh {
    fn new(mesh: TriMesh) -> Self {
        Self {
            tree: FaceTree::new_by(&mesh, &Threads),
            mesh,
        }
    }

    fn shape(&self) -> IndexedMesh<'_> {
        IndexedMesh {
            mesh: &self.mesh,
            tree: &self.tree,
        }
    }
}

/// Runs `touchup compare`: compares, and prints the result.
pub(super) fn compare(arguments: &CompareArguments) -> Result<Losses, CliError> {
    let report = compared(arguments)?;
    print_report(arguments.json, &report, || match arguments.verbose {
        true => format!("{report}\n{}", report.details()),
        false => report.to_string(),
    })?;
    Ok(Losses::new())
}

/// Compares, and writes the requested files.
pub(super) fn compared(arguments: &CompareArguments) -> Result<CompareReport, CliError> {
    arguments.check_alignment()?;
    arguments.check_outputs()?;
    let reading = WorkProgress::stage("read");
    let Scan { mesh: as_read, .. } = read_scan(&arguments.mesh, arguments.mesh_unit)?;
    let Scan { mesh: truth, .. } =
        read_scan(&arguments.truth, arguments.truth_unit).map_err(CliError::truth)?;
    let before = arguments
        .before
        .as_ref()
        .map(|path| read_scan(path, arguments.mesh_unit))
        .transpose();
    let before = before?.map(|file| file.mesh);
    let regions = read_regions(&arguments.mesh, arguments.mesh_unit, &as_read)?;
    let units = [arguments.mesh_unit, arguments.truth_unit];
    let unlike = UnlikeExtents::of(&as_read, &truth);
    if let Some(advice) = unlike.and_then(|unlike| advice_on(unlike, units, arguments.align)) {
        warn!("{advice}");
    }
    let truth = PlacedMesh::new(truth);
    drop(reading);

    let (pose, alignment) = arguments.aligned(&as_read, &truth)?;
    let mesh = PlacedMesh::new(moved(&as_read, &pose));
    let before = before.map(|scan| PlacedMesh::new(moved(&scan, &pose)));
    let (scanned, refined) =
        arguments.measure(&mesh, &truth, before.as_ref(), regions.as_deref())?;
    if let Some(path) = &arguments.picture {
        let labels = arguments.feature_labels(&pose)?;
        let caption = format!(
            "{}; {}",
            today(),
            alignment
                .as_ref()
                .map_or("not aligned".to_owned(), AlignmentReport::in_short)
        );
        let before = before.as_ref().zip(scanned.as_ref());
        arguments.draw(
            path,
            (&mesh, &refined),
            before,
            &caption,
            &labels,
            regions.as_deref(),
        )?;
    }
    if let Some(path) = &arguments.coloured {
        arguments.write_deviations(path, &as_read, &refined)?;
    }
    let shapes = [
        (&*arguments.mesh, &as_read),
        (&*arguments.truth, &truth.mesh),
    ];
    Ok(CompareReport::of(
        shapes,
        alignment,
        scanned.as_ref(),
        &refined,
    ))
}

impl CompareArguments {
    /// Arguments for the picture deviation.png of refined.ply and scan.ply beside truth.ply in one
    /// folder, all in mm.
    ///
    /// - `named`: features to label in the picture.
    pub(super) fn in_folder(folder: &Path, named: Vec<FeatureRecord>) -> Self {
        let [mesh, truth] = [ResultFiles::MESH, "truth.ply"].map(|name| folder.join(name));
        let [before, picture] = ["scan.ply", "deviation.png"].map(|name| Some(folder.join(name)));
        let tolerance_mm = Some(TOLERANCE_MM);
        Self {
            mesh,
            truth,
            before,
            picture,
            tolerance_mm,
            named,
            samples: SAMPLES,
            seed: 1,
            ..Self::default()
        }
    }

    /// Motion of the mesh onto the truth.
    fn aligned(
        &self,
        mesh: &TriMesh,
        truth: &PlacedMesh,
    ) -> Result<(Isometry3<f64>, Option<AlignmentReport>), CliError> {
        let alternative = self.alternative.map(usize::from);
        match self.align {
            Align::None => Ok((Isometry3::identity(), None)),
            Align::Icp => aligned_by_icp(mesh, truth.shape(), self.seed),
            Align::Features => {
                aligned_by_features(mesh, truth.shape(), self.seed, alternative, self.json)
            }
            Align::Pairs => aligned_by_pairs(self.pairs()?),
        }
    }

    /// Writes the mesh, coloured by deviation.
    fn write_deviations(
        &self,
        path: &Path,
        mesh: &TriMesh,
        found: &Comparison,
    ) -> Result<(), CliError> {
        let deviations = || found.vertex_deviations.iter();
        let colours: Vec<_> = deviations().map(|&d| colour_of(d, found.range)).collect();
        let in_mm: Vec<f32> = deviations().map(|d| (d * 1e3) as f32).collect();
        let column = VertexColumn {
            name: "deviation_mm",
            values: in_mm.into(),
        };
        write_coloured(path, mesh, self.mesh_unit, &colours, [column])
    }

    /// Compares the scan before, if any, and the mesh, in one range.
    fn measure(
        &self,
        mesh: &PlacedMesh,
        truth: &PlacedMesh,
        before: Option<&PlacedMesh>,
        regions: Option<&[SupportRegion]>,
    ) -> Result<(Option<Comparison>, Comparison), CliError> {
        let _measuring = WorkProgress::stage("measure");
        let [range, tolerance] =
            [self.range_mm, self.tolerance_mm].map(|mm| mm.map(|mm| mm * 1e-3));
        let params = CompareParams {
            samples: self.samples as usize,
            seed: self.seed,
            range,
            tolerance,
            ..Default::default()
        };
        let through = regions.map_or(Regions::Unknown, |regions| {
            Regions::Of(mesh.shape(), regions)
        });
        let compared = |scan: &PlacedMesh| {
            compare_shapes(scan.shape(), truth.shape(), through, &params, &Threads)
        };
        let before = before.map(compared).transpose()?;
        // one scale for both shows the improvement
        let params = CompareParams {
            range: before.as_ref().map(|before| before.range).or(range),
            ..params
        };
        let own = regions.map_or(Regions::Unknown, Regions::Own);
        Ok((
            before,
            compare_shapes(mesh.shape(), truth.shape(), own, &params, &Threads)?,
        ))
    }

    /// Draws the deviations.
    ///
    /// - `regions`: one per vertex slot of the mesh.
    fn draw(
        &self,
        path: &Path,
        (mesh, refined): (&PlacedMesh, &Comparison),
        before: Option<(&PlacedMesh, &Comparison)>,
        caption: &str,
        labels: &[PictureLabel],
        regions: Option<&[SupportRegion]>,
    ) -> Result<(), CliError> {
        let _drawing = WorkProgress::stage("draw");
        let title = format!(
            "{} against {}",
            file_name(&self.mesh),
            file_name(&self.truth)
        );
        let note = |compared| table::note(compared, self.tolerance_mm);
        let scan = before
            .zip(self.before.as_ref())
            .map(|((scan, scanned), path)| {
                (
                    scan,
                    scanned,
                    format!("before: {}", file_name(path)),
                    note(scanned),
                )
            });
        let now = (
            mesh,
            refined,
            format!("after: {}", file_name(&self.mesh)),
            note(refined),
        );
        let panels: Vec<PicturePanel<'_>> = scan
            .iter()
            .chain([&now])
            .map(|(placed, compared, title, note)| PicturePanel {
                deviations: &compared.vertex_deviations,
                histogram: table::shown(compared).map(|part| &part.histogram),
                title: if scan.is_some() { title } else { "" },
                note,
                ..PicturePanel::of(&placed.mesh)
            })
            .collect();
        let is_touched = |region: &SupportRegion| *region == SupportRegion::Touched;
        let weights = regions
            .filter(|regions| regions.iter().any(is_touched))
            .map(|regions| {
                regions
                    .iter()
                    .map(|region| if is_touched(region) { 1.0 } else { 0.0 })
                    .collect::<Vec<f64>>()
            });
        let params = PictureParams {
            title: &title,
            caption,
            range: refined.range,
            tolerance: self.tolerance_mm.map(|tolerance| tolerance * 1e-3),
            from: self.view.direction()?,
            weights: weights.as_deref(),
            labels,
            ..PictureParams::default()
        };
        write_picture(path, &panels, &params)
    }

    /// Labels of the features with their sizes, after the alignment.
    fn feature_labels(&self, pose: &Isometry3<f64>) -> Result<Vec<PictureLabel>, CliError> {
        let read = self
            .features
            .as_deref()
            .map(read_features)
            .transpose()?
            .unwrap_or_default();
        let label = |feature: &FeatureRecord| {
            let text = match (
                feature.kind.as_str(),
                feature.diameter_mm,
                feature.width_mm.zip(feature.length_mm),
            ) {
                (kind @ ("hole" | "boss"), Some(diameter), _) => format!("{kind} Ø{diameter:.2}"),
                (kind @ ("slot" | "pocket"), _, Some((width, length))) => {
                    format!("{kind} {width:.2} × {length:.2}")
                }
                _ => return None,
            };
            Some(PictureLabel {
                place: pose * (Point3::from(feature.center_mm?) * 1e-3),
                text,
            })
        };
        Ok(read
            .features
            .iter()
            .chain(&self.named)
            .filter_map(label)
            .collect())
    }

    fn pairs(&self) -> Result<&Path, CliError> {
        let missing =
            || CliError::usage("--align pairs needs a file: compare MESH TRUTH --align pairs FILE");
        self.pairs.as_deref().ok_or_else(missing)
    }

    fn check_alignment(&self) -> Result<(), CliError> {
        if self.align == Align::Pairs {
            self.pairs()?;
        } else if let Some(path) = &self.pairs {
            return Err(CliError::usage(format!(
                "{} is one file too many without --align pairs",
                path.display()
            )));
        }
        let is_allowed = self.alternative.is_none() || self.align == Align::Features;
        require(
            is_allowed,
            "--alternative chooses among what --align features finds",
        )
    }

    /// Checks the outputs before the work begins.
    fn check_outputs(&self) -> Result<(), CliError> {
        let outputs = [
            ("--picture", ".png", &self.picture),
            ("--coloured", ".ply", &self.coloured),
        ];
        let [before, pairs, features] =
            [&self.before, &self.pairs, &self.features].map(Option::as_ref);
        let inputs = [Some(&self.mesh), Some(&self.truth), before, pairs, features];
        check_outputs(&outputs, &inputs, "compared: choose another place")?;
        self.view.direction().map(drop)
    }
}

fn positive(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(value) if value > 0.0 && value.is_finite() => Ok(value),
        _ => Err("must be a number above 0".to_owned()),
    }
}

/// Support of each vertex of a refined PLY; `None` for a mesh without it.
fn read_regions(
    path: &Path,
    unit: MeshUnit,
    mesh: &TriMesh,
) -> Result<Option<Vec<SupportRegion>>, CliError> {
    let columns = read_vertex_columns(path, unit, mesh, ["support", "touched"])?;
    let of_support = |support: &f32| match *support {
        0.0 => SupportRegion::Untouched,
        1.0 => SupportRegion::Touched,
        _ => SupportRegion::Guessed,
    };
    let of_touched = |touched: &f32| match *touched {
        ..=0.0 => SupportRegion::Untouched,
        1.0.. => SupportRegion::Touched,
        _ => SupportRegion::Guessed,
    };
    let regions = match columns {
        [Some(support), _] => support.iter().map(of_support).collect::<Vec<_>>(),
        [None, Some(touched)] => touched.iter().map(of_touched).collect(),
        [None, None] => return Ok(None),
    };
    Ok((regions.len() == mesh.vertex_slots()).then_some(regions))
}

/// Advice if two shapes hardly show one part in one frame.
fn advice_on(
    unlike: UnlikeExtents,
    [mesh_unit, truth_unit]: [MeshUnit; 2],
    align: Align,
) -> Option<String> {
    const ALIKE: std::ops::Range<f64> = 0.6..1.7;
    let ratio = match unlike {
        UnlikeExtents::Size(ratio) => ratio,
        UnlikeExtents::Apart(_) if align == Align::None => {
            return Some(format!(
                "{unlike}: are both in one frame? --align features brings them together"
            ));
        }
        UnlikeExtents::Apart(_) => return None,
    };
    let units = [MeshUnit::Millimetre, MeshUnit::Inch, MeshUnit::Metre];
    let of_mesh = units
        .iter()
        .filter(|u| ALIKE.contains(&(ratio * u.metres() / mesh_unit.metres())));
    let of_truth = units
        .iter()
        .filter(|u| ALIKE.contains(&(ratio / u.metres() * truth_unit.metres())));
    let flags: Vec<String> = of_mesh
        .map(|unit| format!("--mesh-unit {unit}"))
        .chain(of_truth.map(|unit| format!("--truth-unit {unit}")))
        .collect();
    let advice = if flags.is_empty() {
        "are these the same part?".to_owned()
    } else {
        format!("try {}", flags.join(" or "))
    };
    Some(format!("{unlike}: {advice}"))
}
