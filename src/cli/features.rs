//! `touchup features`: holes, slots, edges and planes of a mesh and its touches, if any.

use std::iter;
use std::path::PathBuf;
use std::time::Instant;

use clap::{Args, ValueEnum};

use super::common::progress::WorkProgress;
use super::{CliError, Losses, check_kept_by, counted, print_report, require};
use touchup_features::features::curvature;
use touchup_features::features::{Cluster, ClusterParams, PaperParams, clusters, paper_clusters};
use touchup_features::features::{Detection, Feature, FeatureKind, FittedTo, Form, MeasuredValue};
use touchup_geometry::mesh::TriMesh;
use touchup_io::features_file::FeatureFile;
use touchup_io::mesh_file::MeshUnit;
use touchup_io::result_table::write_features_as_named;
use touchup_io::touches_file::read_touches;
use touchup_session::scan::{Scan, read_scan};
use touchup_session::session::{found, found_with_boundary, write_boundary};

#[derive(Debug, Args)]
pub(super) struct FeaturesArguments {
    /// Mesh (PLY, STL, OBJ) or point cloud (PLY, PCD, XYZ, E57)
    #[arg(value_name = "MESH")]
    mesh: PathBuf,
    /// Unit of the coordinates in MESH
    #[arg(long, value_name = "U", default_value = "mm")]
    mesh_unit: MeshUnit,
    /// Touches, as from refine --touches-out
    #[arg(long, value_name = "CSV")]
    touches: Option<PathBuf>,
    /// Kind of search
    #[arg(long, value_name = "MODE", default_value = "fitted")]
    mode: FeaturesMode,
    /// paper: number of clusters; default: estimated from the data
    #[arg(long, value_name = "K", value_parser = clap::value_parser!(u32).range(1..=10_000))]
    clusters: Option<u32>,
    /// paper: lower limit of the Gaussian curvature of cluster vertices, 1/mm²
    #[arg(long, value_name = "T", default_value_t = 0.3)]
    threshold_per_mm2: f64,
    /// Output: the features as JSON, or as a table, .csv or .parquet
    #[arg(long, value_name = "FEATURES")]
    out: Option<PathBuf>,
    /// Output: the faces as a STEP file (AP242) for CAD programs: planes, cylinders, cones and
    /// spheres, trimmed where they meet
    #[arg(long, value_name = "STEP")]
    step: Option<PathBuf>,
    /// Prints the features as JSON
    #[arg(long)]
    json: bool,
}

/// Kind of search on a mesh.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum FeaturesMode {
    /// Holes, slots, pockets, bosses, spheres, edges, corners and planes, fitted by least squares
    Fitted,
    /// Control points of the paper: clusters of high Gaussian curvature
    Paper,
}

/// Runs `touchup features`: finds, and prints the result.
pub(super) fn features(arguments: &FeaturesArguments) -> Result<Losses, CliError> {
    arguments.check()?;
    for (flag, out) in [("--out", &arguments.out), ("--step", &arguments.step)] {
        let Some(out) = out else { continue };
        check_kept_by(flag, "MESH", &arguments.mesh, out)?;
        if let Some(touches) = &arguments.touches {
            check_kept_by(flag, "--touches", touches, out)?;
        }
    }
    let Scan { mesh, repair, .. } = read_scan(&arguments.mesh, arguments.mesh_unit)?;
    let touches = arguments
        .touches
        .as_deref()
        .map_or_else(|| Ok(Vec::new()), read_touches)?;
    let started = Instant::now();
    let (table, file, boundary) = match (arguments.mode, &arguments.step) {
        (FeaturesMode::Fitted, None) => {
            let _finding = WorkProgress::stage("find features");
            let (detection, file) = found(&mesh, &touches);
            (feature_table(&detection), file, None)
        }
        (FeaturesMode::Fitted, Some(step)) => {
            let _finding = WorkProgress::stage("find features and faces");
            let (detection, file, boundary) = found_with_boundary(&mesh, &touches);
            (feature_table(&detection), file, Some((step, boundary)))
        }
        (FeaturesMode::Paper, _) => {
            let file = FeatureFile::of_clusters(&arguments.find_clusters(&mesh));
            (cluster_table(&file), file, None)
        }
    };
    let took_s = started.elapsed().as_secs_f64();
    if let Some(out) = &arguments.out {
        write_features_as_named(out, &file)?;
    }
    let mut wrote = arguments
        .out
        .as_ref()
        .map_or(String::new(), |out| format!("\nwrote {}", out.display()));
    if let Some((step, boundary)) = boundary {
        let summary = write_boundary(step, &boundary)?;
        wrote += &format!("\nwrote {}: {summary}", step.display());
    }
    print_report(arguments.json, &file, || {
        format!("mesh: {repair}\n{table}\nfound in {took_s:.2} s{wrote}")
    })?;
    Ok(Losses::new())
}

impl FeaturesArguments {
    /// Refuses incompatible flags.
    fn check(&self) -> Result<(), CliError> {
        let is_paper = self.mode == FeaturesMode::Paper;
        let is_above_0 = self.threshold_per_mm2 > 0.0 && self.threshold_per_mm2.is_finite();
        require(
            self.clusters.is_none() || is_paper,
            "--clusters is for --mode paper",
        )?;
        require(
            self.touches.is_none() || !is_paper,
            "--touches measures features, and --mode paper has none",
        )?;
        require(
            self.step.is_none() || !is_paper,
            "--step writes fitted faces, and --mode paper has none",
        )?;
        require(is_above_0, "--threshold-per-mm2 must be above 0")
    }

    fn find_clusters(&self, mesh: &TriMesh) -> Vec<Cluster> {
        let _finding = WorkProgress::stage("find clusters");
        let curvature = curvature(mesh);
        match self.clusters {
            Some(k) => {
                let params = PaperParams {
                    threshold: self.threshold_per_mm2 * 1e6,
                    k: k as usize,
                    ..PaperParams::default()
                };
                paper_clusters(mesh, &curvature, &params)
            }
            None => clusters(mesh, &curvature, &ClusterParams::default()),
        }
    }
}

/// Clusters as text.
fn cluster_table(FeatureFile { clusters, .. }: &FeatureFile) -> String {
    if clusters.is_empty() {
        return "no vertex is curved enough: a lower --threshold-per-mm2, or leave --clusters out"
            .to_owned();
    }
    let head = format!(
        "{}\n{:>28}  {:>8}  bent",
        counted(clusters.len(), "cluster", "clusters"),
        "center, mm",
        "vertices"
    );
    let rows = clusters.iter().map(|cluster| {
        let [x, y, z] = cluster.center_mm;
        let bent = cluster
            .convex
            .map_or("", |convex| if convex { "outward" } else { "inward" });
        format!(
            "{:>28}  {:>8}  {bent}",
            format!("{x:.2} {y:.2} {z:.2}"),
            cluster.vertices
        )
    });
    iter::once(head).chain(rows).collect::<Vec<_>>().join("\n")
}

/// Features as text.
fn feature_table(
    Detection {
        features,
        unexplained,
        ..
    }: &Detection,
) -> String {
    let mut lines = Vec::new();
    if features.is_empty() {
        lines.push("no features".to_owned());
    } else {
        let counts: Vec<_> = FeatureKind::ALL
            .into_iter()
            .filter_map(|kind| count(features, kind))
            .collect();
        lines.push(format!("features: {}", counts.join(", ")));
        lines.push(format!(
            "{:>4}  {:<7} {:>28}  {:<61} fitted to",
            "id", "kind", "center, mm", "size, mm"
        ));
        lines.extend(
            features
                .iter()
                .filter(|feature| feature.kind != FeatureKind::Plane)
                .map(row),
        );
    }
    if *unexplained > NOTABLE {
        lines.push(format!(
            "not looked at: {:.0} % of the surface, which is neither flat nor round",
            unexplained * 100.0
        ));
    }
    lines.join("\n")
}

/// Smallest listed share of the surface.
const NOTABLE: f64 = 0.05;

fn count(features: &[Feature], kind: FeatureKind) -> Option<String> {
    let count = features
        .iter()
        .filter(|feature| feature.kind == kind)
        .count();
    let ending = if matches!(kind, FeatureKind::Boss | FeatureKind::Notch) {
        "es"
    } else {
        "s"
    };
    (count > 0).then(|| counted(count, kind.name(), &format!("{}{ending}", kind.name())))
}

fn row(feature: &Feature) -> String {
    let c = feature.centre.value.coords * 1e3;
    let place = format!("{:.2} {:.2} {:.2}", c.x, c.y, c.z);
    let from = match feature.fitted_to {
        FittedTo::Touches => format!("touches, {:.0} % touched", feature.touched * 100.0),
        FittedTo::Mesh => "mesh".to_owned(),
    };
    format!(
        "{:>4}  {:<7} {place:>28}  {:<61} {from}",
        feature.id,
        feature.kind.name(),
        size(feature)
    )
}

fn size(feature: &Feature) -> String {
    let mut parts = Vec::new();
    let mut part = |before: &str, measured: &Option<MeasuredValue<f64>>| {
        if let Some(measured) = measured {
            parts.push(format!("{before}{}", with_std(measured)));
        }
    };
    part("Ø ", &feature.diameter);
    part("", &feature.width);
    part("× ", &feature.length);
    match feature.through {
        Some(true) => parts.push("through".to_owned()),
        _ => part("deep ", &feature.depth),
    }
    if let Some(cone) = &feature.cone_angle {
        parts.push(format!("countersunk {:.1}°", cone.value.to_degrees()));
    }
    if let Some(facets) = feature.facets {
        parts.push(format!("facets {:.3} inside", facets * 1e3));
    }
    if let (Some(Form::Round(form)), FittedTo::Mesh) = (&feature.form, feature.fitted_to)
        && form.roundness.minimum_zone.value > NOTABLE_FORM
    {
        let roundness = form.roundness.minimum_zone.value;
        parts.push(format!("out of round by {:.3}", roundness * 1e3));
    }
    parts.join(" ")
}

/// Smallest listed roundness of a CAD mesh, m: smaller values are its rounding.
const NOTABLE_FORM: f64 = 1e-6;

fn with_std(measured: &MeasuredValue<f64>) -> String {
    let std = measured
        .std
        .map_or_else(String::new, |std| format!(" ± {:.3}", std * 1e3));
    let bound = if measured.is_at_least { "≥ " } else { "" };
    format!("{bound}{:.3}{std}", measured.value * 1e3)
}
