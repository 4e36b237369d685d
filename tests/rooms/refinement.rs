//! A refinement by its three ways in: a recording, messages that are there already, and samples
//! that are pushed. By the first `touchup refine` and sweeps go, by the others the Python package.

use std::fs;
use std::path::Path;

use nalgebra::UnitQuaternion;
use touchup::io::mesh_file::MeshUnit;
use touchup::io::recording::{StampSource, Topics, write_recording};
use touchup::refinement::{
    InputNames, JudgedRefinement, RefinedScan, RefinementInput, TouchSource, refine,
};
use touchup::replay::{Recording, each_sample_of};
use touchup::scan::read_scan;
use touchup::scene::Scene;
use touchup::session::RefinedMesh;

use crate::cli::{flat_scan, touch};

fn same_bits(one: &RefinedMesh, other: &RefinedMesh) -> bool {
    // where nothing is known there is NaN
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
    let refined = |touches| refine(input(), touches, names, false, &mut || {}).unwrap();

    let recording =
        Box::new(Recording::open(&bag, &Topics::default(), StampSource::Header).unwrap());
    let wrench_frame = recording.wrench_frame;
    let markers = None;
    let of_recording = refined(TouchSource::Recorded { recording, markers });
    let of_messages = refined(TouchSource::Messages {
        messages: messages.clone(),
        wrench_frame,
    });

    let mut pushed = JudgedRefinement::new(input(), wrench_frame).unwrap();
    let scene = input().scene;
    let (placement, sync) = (scene.placement(), scene.sync_params());
    let push = |sample: &_| {
        pushed.push(sample).unwrap();
    };
    each_sample_of(messages, wrench_frame, placement, sync, &mut |_| {}, push).unwrap();
    let of_samples = pushed.finish(names, false).unwrap();

    assert!(of_recording.finished.counts.contacts == 1 && of_recording.accepted > 900);
    let judged = |refined: &RefinedScan| (refined.accepted, refined.findings.clone());
    for other in [&of_messages, &of_samples] {
        assert!(same_bits(&of_recording.finished.mesh, &other.finished.mesh));
        assert_eq!(judged(&of_recording), judged(other));
    }
    assert_eq!(of_recording.refused, of_messages.refused);
}
