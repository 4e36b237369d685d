//! A refinement by its three ways in: a recording, messages in memory, and pushed samples. `touchup
//! refine` and sweeps use the first, the Python package the others.

use std::fs;
use std::path::{Path, PathBuf};

use nalgebra::{Point3, UnitQuaternion, Vector3};
use touchup::brep::{AnalyticSurface, SurfaceShape};
use touchup::io::mesh_file::MeshUnit;
use touchup::io::recording::{StampSource, Topics, write_recording};
use touchup::io::recording::{append_known_surfaces, known_surfaces_beside};
use touchup::reconstruct::KnownSurface;
use touchup::refinement::{
    InputNames, OpenedInput, RefinedScan, Refinement, RefinementError, RefinementInput,
    RefinementOptions, RefinementSummary, refine,
};
use touchup::replay::{RecordedAs, Recording, each_sample};
use touchup::scan::read_scan;
use touchup::scene::Scene;
use touchup::session::RefinedMesh;
use touchup::stylus::ProbedPoint;

use crate::cli::{flat_scan, touch};

fn same_bits(one: &RefinedMesh, other: &RefinedMesh) -> bool {
    // unknown values are NaN
    let known = |of: &RefinedMesh| format!("{:?} {:?}", of.sigma, of.touches);
    one.mesh.positions() == other.mesh.positions()
        && one.mesh.faces().eq(other.mesh.faces())
        && one.support == other.support
        && known(one) == known(other)
}

#[test]
fn a_recording_its_messages_and_its_samples_make_the_same_mesh() {
    let folder = tempfile::tempdir().unwrap();
    let [scan, bag] = ["scan.ply", "touch.mcap"].map(|name| folder.path().join(name));
    fs::write(&scan, flat_scan()).unwrap();
    let messages = touch(UnitQuaternion::identity(), false);
    let written = messages.iter().copied();
    write_recording(&bag, &Topics::default(), "object", "stylus", written).unwrap();
    let input = || {
        let scene = Scene::from_yaml("tip: { radius_mm: 1.5 }\n").unwrap();
        let scan = read_scan(&scan, MeshUnit::Millimetre).unwrap().mesh;
        RefinementInput::new(scene, scan).unwrap()
    };
    let names = InputNames {
        scan: Path::new("the scan"),
        recording: Path::new("the recording"),
    };
    let open = || Recording::open(&bag, &Topics::default(), StampSource::Header).unwrap();
    let wrench_frame = open().wrench_frame;
    let options = RefinementOptions::default;
    let refined =
        |recording| refine(input(), recording, None, options(), names, &mut || {}).unwrap();
    let of_recording = refined(open());
    let of_messages = refined(Recording::of_messages(messages.clone(), wrench_frame));

    let mut pushed = Refinement::new(input(), wrench_frame, options()).unwrap();
    let scene = input().scene;
    let (placement, sync) = (scene.placement(), scene.sync_params());
    let mut moved = 0;
    let push = |sample: &_| {
        let update = pushed.push(sample).unwrap();
        moved += u64::from(update.is_some_and(|update| update.fit.is_some()));
    };
    let again = Recording::of_messages(messages, wrench_frame);
    each_sample(again, placement, sync, None, &mut || {}, &mut |_| {}, push).unwrap();
    // pushed samples move the mesh one by one, those of a recording wait for the patch alone
    assert!(moved > 100);
    let of_samples = pushed.finish(names).unwrap();

    let summary = &of_recording.summary;
    assert!(summary.contacts == 1 && summary.accepted > 900);
    let judged = |refined: &RefinedScan| {
        let RefinementSummary {
            accepted,
            contacts,
            findings,
            ..
        } = &refined.summary;
        (*accepted, *contacts, findings.clone())
    };
    for other in [&of_messages, &of_samples] {
        assert!(same_bits(&of_recording.mesh, &other.mesh));
        assert_eq!(judged(&of_recording), judged(other));
    }
    assert_eq!(summary.refused, of_messages.summary.refused);
}

/// A plane, 0.05 mm above the touch, that goes on beside it.
fn plane_at(touch: &ProbedPoint) -> KnownSurface {
    let height = Vector3::z() * 0.05e-3;
    let corner = |x: f64, y: f64| touch.point + Vector3::new(x, y, 0.0) * 4e-3 + height;
    KnownSurface {
        surface: AnalyticSurface::along(touch.point + height, Vector3::z(), SurfaceShape::Plane),
        is_concave: false,
        sigma: 5e-6,
        contacts: vec![touch.point],
        others: Vec::new(),
        ends: vec![corner(-1.0, -1.0), corner(1.0, -1.0), corner(0.0, 1.0)],
    }
}

/// A recording of one touch on a flat scan, in files.
struct OneTouch {
    _folder: tempfile::TempDir,
    scan: PathBuf,
    bag: PathBuf,
}

impl OneTouch {
    fn new() -> Self {
        let folder = tempfile::tempdir().unwrap();
        let [scan, bag] = ["scan.ply", "touch.mcap"].map(|name| folder.path().join(name));
        fs::write(&scan, flat_scan()).unwrap();
        let messages = touch(UnitQuaternion::identity(), false);
        write_recording(&bag, &Topics::default(), "object", "stylus", messages).unwrap();
        Self {
            _folder: folder,
            scan,
            bag,
        }
    }

    fn names(&self) -> InputNames<'_> {
        InputNames {
            scan: &self.scan,
            recording: &self.bag,
        }
    }

    fn opened(&self, radius_mm: f64) -> Result<OpenedInput, RefinementError> {
        let scene = Scene::from_yaml(&format!("tip: {{ radius_mm: {radius_mm} }}\n")).unwrap();
        let scan = (&*self.scan, MeshUnit::Millimetre);
        OpenedInput::open(scene, scan, (&self.bag, &RecordedAs::default()))
    }

    fn refined(&self, radius_mm: f64) -> Result<RefinedScan, RefinementError> {
        let OpenedInput {
            input, recording, ..
        } = self.opened(radius_mm)?;
        let options = RefinementOptions::default();
        refine(input, recording, None, options, self.names(), &mut || {})
    }

    /// Writes a surface beside the recording; returns it as read, and the path.
    fn know_plane(&self, touch: &ProbedPoint) -> (Vec<KnownSurface>, PathBuf) {
        let path = known_surfaces_beside(&self.bag);
        let known = append_known_surfaces(&path, &[plane_at(touch)], 1.5e-3).unwrap();
        (known, path)
    }
}

#[test]
fn surfaces_beside_a_recording_make_the_mesh_of_a_session_that_knew_them() {
    let files = OneTouch::new();
    let without = files.refined(1.5).unwrap();
    let touch = &without.mesh.touches[0];
    let (known, path) = files.know_plane(touch);
    let with = files.refined(1.5).unwrap();
    assert!(!same_bits(&with.mesh, &without.mesh));
    // between its ends the mesh is the plane
    let height = touch.point.z + 0.05e-3;
    let mesh = &with.mesh.mesh;
    let corners = mesh.faces().flat_map(|(face, _)| mesh.triangle(face));
    let is_on = |p: &Point3<f64>| (p - touch.point).xy().norm() < 1.2e-3;
    let on_plane: Vec<_> = corners.filter(is_on).collect();
    assert!(!on_plane.is_empty() && on_plane.iter().all(|p| (p.z - height).abs() < 1e-9));

    // a session learns of them after the touches
    let OpenedInput {
        input, recording, ..
    } = files.opened(1.5).unwrap();
    let (placement, sync) = (input.scene.placement(), input.scene.sync_params());
    let options = RefinementOptions::default();
    let mut session = Refinement::new(input, recording.wrench_frame, options).unwrap();
    let push = |sample: &_| _ = session.push(sample).unwrap();
    each_sample(
        recording,
        placement,
        sync,
        None,
        &mut || {},
        &mut |_| {},
        push,
    )
    .unwrap();
    known
        .into_iter()
        .for_each(|known| session.know(known).unwrap());
    assert!(same_bits(
        &with.mesh,
        &session.finish(files.names()).unwrap().mesh
    ));

    // with another tip the same touches lie elsewhere
    let other = files.refined(1.4).unwrap();
    fs::remove_file(&path).unwrap();
    assert!(same_bits(&other.mesh, &files.refined(1.4).unwrap().mesh));
}

#[test]
fn a_bad_surface_beside_a_recording_is_named_by_its_line() {
    let files = OneTouch::new();
    let (_, path) = files.know_plane(&files.refined(1.5).unwrap().mesh.touches[0]);
    let good = fs::read_to_string(&path).unwrap();
    for (from, to, word) in [
        (&*good, "[]\n", "known_surfaces.jsonl: line 2: invalid"),
        (
            "0.0,0.0,1.0",
            "0.0,0.0,1e400",
            "line 2: number out of range",
        ),
        (
            "0.0,0.0,1.0",
            "0.0,0.0,0.0",
            "line 2: its axis is no unit vector",
        ),
        ("\"sigma_mm\":", "\"sigma_mm\":-", "line 2: its uncertainty"),
        (
            "\"ends_mm\":[[",
            "\"ends_mm\":[[1,2,3],[",
            "line 2: a contact or end",
        ),
        (
            "\"contacts_mm\":[[",
            "\"contacts_mm\":[],\"ends_mm\":[[",
            "line 2: ",
        ),
    ] {
        let bad = good.replace(from, to);
        assert_ne!(bad, good, "{word}");
        fs::write(&path, format!("{good}{bad}")).unwrap();
        let why = files.refined(1.5).unwrap_err().to_string();
        assert!(why.contains(word), "{why}");
    }
}
