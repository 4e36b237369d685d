//! A refinement by its three ways in: a recording, messages in memory, and pushed samples. `touchup
//! refine` and sweeps use the first, the Python package the others.

use std::fs;
use std::path::Path;

use nalgebra::UnitQuaternion;
use touchup::io::mesh_file::MeshUnit;
use touchup::io::recording::{StampSource, Topics, write_recording};
use touchup::refinement::{
    InputNames, RefinedScan, Refinement, RefinementInput, RefinementOptions, RefinementSummary,
    refine,
};
use touchup::replay::{Recording, each_sample};
use touchup::scan::read_scan;
use touchup::scene::Scene;
use touchup::session::RefinedMesh;

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
