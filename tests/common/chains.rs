//! Arms as chains of joints.

use std::f64::consts::FRAC_PI_2;

use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};
use touchup::probing::arm::{ChainJoint, ChainLink, SerialChain, UrGeometry};

/// Translation by `d` along z, then by `a` along x, then turn by `alpha` about x: the transform
/// after a joint's turn in Denavit and Hartenberg's rows.
fn after_joint(d: f64, a: f64, alpha: f64) -> Isometry3<f64> {
    let tilt = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), alpha);
    Isometry3::from_parts(Translation3::new(a, 0.0, d), tilt)
}

/// Joints about the z axes of frames, each frame given in the one before after its turn; the last
/// is the flange.
fn chain_of(frames: &[Isometry3<f64>], ranges: &[[f64; 2]], radius: f64) -> SerialChain {
    let (end, origins) = frames.split_last().unwrap();
    let joint = |(number, (origin, range)): (usize, (&Isometry3<f64>, &[f64; 2]))| ChainJoint {
        name: format!("joint{}", number + 1).into(),
        origin: *origin,
        axis: Vector3::z_axis(),
        range: Some(*range),
    };
    let joints: Vec<_> = origins.iter().zip(ranges).enumerate().map(joint).collect();
    let link = |number: usize| ChainLink {
        name: format!("link{number}").into(),
        body: None,
    };
    SerialChain::new(joints, (0..=ranges.len()).map(link).collect(), *end, radius).unwrap()
}

/// A UR, by the same lengths.
pub fn ur_chain(ur: &UrGeometry, radius: f64) -> SerialChain {
    let turn = 2.0 * std::f64::consts::PI;
    let frames = [
        Isometry3::identity(),
        after_joint(ur.d1, 0.0, FRAC_PI_2),
        after_joint(0.0, ur.a2, 0.0),
        after_joint(0.0, ur.a3, 0.0),
        after_joint(ur.d4, 0.0, FRAC_PI_2),
        after_joint(ur.d5, 0.0, -FRAC_PI_2),
        after_joint(ur.d6, 0.0, 0.0),
    ];
    chain_of(&frames, &[[-turn, turn]; 6], radius)
}

/// An arm with seven joints, with lengths and ranges as the maker of one states them, in modified
/// rows of Denavit and Hartenberg \[Craig 1986\]: turned about x, along x, along z, before the turn
/// of the joint.
pub fn seven_joints() -> SerialChain {
    let before_joint = |a: f64, d: f64, alpha: f64| {
        let tilt = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), alpha);
        Isometry3::from_parts(
            Translation3::from(Vector3::new(a, 0.0, 0.0) + tilt * Vector3::new(0.0, 0.0, d)),
            tilt,
        )
    };
    let quarter = FRAC_PI_2;
    let frames = [
        before_joint(0.0, 0.333, 0.0),
        before_joint(0.0, 0.0, -quarter),
        before_joint(0.0, 0.316, quarter),
        before_joint(0.0825, 0.0, quarter),
        before_joint(-0.0825, 0.384, -quarter),
        before_joint(0.0, 0.0, quarter),
        before_joint(0.088, 0.0, quarter),
        before_joint(0.0, 0.107, 0.0),
    ];
    let ranges = [
        [-2.8973, 2.8973],
        [-1.7628, 1.7628],
        [-2.8973, 2.8973],
        [-3.0718, -0.0698],
        [-2.8973, 2.8973],
        [-0.0175, 3.7525],
        [-2.8973, 2.8973],
    ];
    chain_of(&frames, &ranges, 0.055)
}
