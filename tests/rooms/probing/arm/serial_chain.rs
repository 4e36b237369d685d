//! Arms that are no UR: chains of six or seven joints.

use std::f64::consts::{FRAC_PI_2, PI};

use nalgebra::{Isometry3, Matrix4, Point3, UnitQuaternion, Vector3};
use proptest::prelude::*;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;
use touchup::probing::arm::{
    ArmBodies, ArmGeometry, ChainError, ChainJoint, ChainLink, IkFailure, Joints, LimitError,
    Limits, Link, SerialChain, UrGeometry,
};

use crate::chains::{seven_joints, ur_chain};

/// Modified rows of Denavit and Hartenberg as matrices, as in the book.
fn by_matrices(joints: &[f64]) -> Matrix4<f64> {
    let table = [
        (0.0, 0.0, 0.333),
        (-FRAC_PI_2, 0.0, 0.0),
        (FRAC_PI_2, 0.0, 0.316),
        (FRAC_PI_2, 0.0825, 0.0),
        (-FRAC_PI_2, -0.0825, 0.384),
        (FRAC_PI_2, 0.0, 0.0),
        (FRAC_PI_2, 0.088, 0.0),
        (0.0, 0.0, 0.107),
    ];
    let turns = joints.iter().copied().chain([0.0]);
    table
        .into_iter()
        .zip(turns)
        .fold(Matrix4::identity(), |product, ((alpha, a, d), theta)| {
            let ((st, ct), (sa, ca)) = (f64::sin_cos(theta), f64::sin_cos(alpha));
            #[rustfmt::skip]
        let link = Matrix4::new(
            ct, -st, 0.0, a,
            st * ca, ct * ca, -sa, -d * sa,
            st * sa, ct * sa, ca, d * ca,
            0.0, 0.0, 0.0, 1.0,
        );
            product * link
        })
}

/// Angles in the ranges of the arm with seven joints, by shares.
fn in_range(shares: [f64; 7]) -> Joints {
    let chain = seven_joints();
    Joints::from(shares).mapped(|joint, share| {
        let [low, high] = chain.joints()[joint].range.unwrap();
        low + (high - low) * share
    })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn the_flange_of_seven_joints_is_where_the_matrices_have_it(shares in prop::array::uniform7(0.0..1.0f64)) {
        let joints = in_range(shares);
        let difference = ArmGeometry::from(seven_joints()).flange(&joints).to_homogeneous() - by_matrices(&joints);
        prop_assert!(difference.norm() < 1e-14, "{difference}");
    }

    /// From joints up to 0.3 rad off.
    #[test]
    fn joints_near_others_bring_the_flange_there(
        shares in prop::array::uniform7(0.1..0.9f64), off in prop::array::uniform7(-0.3..0.3f64)
    ) {
        let (arm, joints) = (ArmGeometry::from(seven_joints()), in_range(shares));
        prop_assume!(arm.dexterity(&joints) > 0.02);
        let pose = arm.flange(&joints);
        let found = arm.nearest(&pose, &joints.mapped(|joint, angle| angle + off[joint])).unwrap();
        let error = pose.inv_mul(&arm.flange(&found));
        prop_assert!(error.translation.vector.norm() < 1e-9 && error.rotation.angle() < 1e-9, "{error}");
        for (joint, angle) in seven_joints().joints().iter().zip(found.iter()) {
            prop_assert!(joint.range.is_some_and(|[low, high]| (low..=high).contains(angle)), "{found:?}");
        }
    }

    /// The same lengths as a chain: of the eight solutions in closed form it finds the one nearby.
    #[test]
    fn the_search_finds_the_solution_in_closed_form(
        joints in prop::array::uniform6(-PI..PI), off in prop::array::uniform6(-0.1..0.1f64), arm in 0..2usize
    ) {
        let ur = [UrGeometry::UR3E, UrGeometry::UR10E][arm];
        let (closed, chain) = (ArmGeometry::from(ur), ArmGeometry::from(ur_chain(&ur, 0.05)));
        let joints = Joints::from(joints);
        prop_assume!(closed.dexterity(&joints) > 0.05);
        let pose = closed.flange(&joints);
        prop_assert!((chain.flange(&joints).to_homogeneous() - pose.to_homogeneous()).norm() < 1e-14);
        prop_assert!((chain.jacobian(&joints) - closed.jacobian(&joints)).norm() < 1e-13);
        let near = joints.mapped(|joint, angle| angle + off[joint]);
        let (by_search, in_closed_form) = (chain.nearest(&pose, &near).unwrap(), closed.nearest(&pose, &near).unwrap());
        let far = by_search.iter().zip(in_closed_form.iter()).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        prop_assert!(far < 1e-9, "{by_search:?} {in_closed_form:?}");
    }

    /// The shortest of all turnings that move the flange so: any other has a part that moves
    /// nothing, at a right angle to it.
    #[test]
    fn the_joints_turn_no_more_than_a_velocity_needs(
        shares in prop::array::uniform7(0.1..0.9f64), velocity in prop::array::uniform6(-0.1..0.1f64)
    ) {
        let (arm, joints) = (ArmGeometry::from(seven_joints()), in_range(shares));
        prop_assume!(arm.dexterity(&joints) > 0.02);
        let [x, y, z, a, b, c] = velocity;
        let (linear, angular) = (Vector3::new(x, y, z), Vector3::new(a, b, c));
        let turning = arm.turning(&joints, &linear, &angular).unwrap();
        // by differences of the flange's pose
        let step = 1e-6;
        let [back, forth] = [-step, step].map(|by| arm.flange(&joints.mapped(|joint, angle| angle + by * turning[joint])));
        let moved = (forth.translation.vector - back.translation.vector) / (2.0 * step);
        let turned = (forth.rotation * back.rotation.inverse()).scaled_axis() / (2.0 * step);
        prop_assert!((moved - linear).norm() < 1e-7 && (turned - angular).norm() < 1e-7);
        let svd = arm.jacobian(&joints).columns(0, 7).into_owned().svd(true, true);
        let velocity = nalgebra::SVector::<f64, 6>::from(velocity);
        let shortest = svd.solve(&velocity, 1e-12).unwrap();
        for (joint, rate) in turning.iter().enumerate() {
            prop_assert!((rate - shortest[joint]).abs() < 1e-9);
        }
    }
}

/// A square of 200 mm before the arm, a millimetre at a time: no joint turns by more than the
/// fastest that the least dexterity allows.
#[test]
fn joints_go_on_smoothly_along_straight_ways() {
    let arm = ArmGeometry::from(seven_joints());
    let down = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), PI);
    let corners = [
        [0.4, -0.1],
        [0.6, -0.1],
        [0.6, 0.1],
        [0.4, 0.1],
        [0.4, -0.1],
    ]
    .map(|[x, y]| Vector3::new(x, y, 0.3));
    let pose = |place: Vector3<f64>| Isometry3::from_parts(place.into(), down);
    let mut joints = arm.most_dexterous(&pose(corners[0])).unwrap();
    for ends in corners.windows(2) {
        for step in 1..=200 {
            let share = f64::from(step) / 200.0;
            let pose = pose(ends[0] + (ends[1] - ends[0]) * share);
            let next = arm.nearest(&pose, &joints).unwrap();
            let turn = next
                .iter()
                .zip(joints.iter())
                .map(|(a, b)| (a - b).abs())
                .fold(0.0, f64::max);
            // 1 mm over a reach of 1 m and the dexterity here, which is above 0.1
            assert!(
                arm.dexterity(&next) > 0.1 && turn < 0.01,
                "{turn} {}",
                arm.dexterity(&next)
            );
            let error = pose.inv_mul(&arm.flange(&next));
            assert!(error.translation.vector.norm() < 1e-9 && error.rotation.angle() < 1e-9);
            joints = next;
        }
    }
}

#[test]
fn an_arm_at_the_end_of_a_range_goes_round_it_or_names_the_joint() {
    let arm = ArmGeometry::from(seven_joints());
    // about the vertical through the base: 150° by the first joint, and no more than 166° are in
    // its range
    let pose = |degrees: f64| {
        let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), degrees.to_radians());
        let down = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), PI);
        Isometry3::from_parts((turn * Vector3::new(0.5, 0.0, 0.4)).into(), turn * down)
    };
    let folded = Joints::from([0.0, -0.4, 0.0, -2.2, 0.0, 1.9, 0.8]);
    let mut joints = arm.nearest(&pose(0.0), &folded).unwrap();
    for degrees in 1..=175 {
        joints = arm.nearest(&pose(f64::from(degrees)), &joints).unwrap();
    }
    assert!(
        joints[0] <= 2.8973 && joints[2].abs() > 0.1,
        "the third joint does what the first cannot: {joints:?}"
    );
    // six joints have no other way: a chain whose second joint goes no farther than 10° beyond its
    // present angle
    let ur = UrGeometry::UR5E;
    let whole = ur_chain(&ur, 0.05);
    let now = Joints::from([0.3, -1.2, 1.4, -0.9, 1.1, 0.4]);
    let mut narrow: Vec<ChainJoint> = whole.joints().to_vec();
    for (joint, angle) in narrow.iter_mut().zip(now.iter()) {
        joint.range = Some([angle - 0.35, angle + 0.35]);
    }
    let links = (0..7)
        .map(|number| ChainLink {
            name: format!("{number}").into(),
            body: None,
        })
        .collect();
    let end = Isometry3::translation(0.0, 0.0, ur.d6);
    let narrow = ArmGeometry::from(SerialChain::new(narrow, links, end, 0.05).unwrap());
    let beyond = now.mapped(|joint, angle| if joint == 1 { angle + 0.5 } else { angle });
    let refused = narrow
        .nearest(&ArmGeometry::from(ur).flange(&beyond), &now)
        .unwrap_err();
    assert!(
        matches!(&refused, IkFailure::Range { joint, .. } if &**joint == "joint2"),
        "{refused:?}"
    );
}

#[test]
fn what_is_out_of_reach_is_refused_at_once_and_what_is_within_is_found_from_afar() {
    let arm = ArmGeometry::from(seven_joints());
    let far = Isometry3::translation(1.3, 0.0, 0.3);
    assert_eq!(arm.nearest(&far, &in_range([0.5; 7])), Err(IkFailure::Pose));
    // from each of some configurations to the flange of each other
    let places = [
        [0.3; 7],
        [0.7; 7],
        [0.2, 0.8, 0.4, 0.6, 0.3, 0.7, 0.5],
        [0.8, 0.3, 0.6, 0.4, 0.7, 0.2, 0.5],
    ]
    .map(in_range);
    for from in &places {
        for to in &places {
            let pose = arm.flange(to);
            let found = arm.nearest(&pose, from).unwrap();
            let error = pose.inv_mul(&arm.flange(&found));
            assert!(
                error.translation.vector.norm() < 1e-9 && error.rotation.angle() < 1e-9,
                "{error}"
            );
        }
    }
}

#[test]
fn limits_hold_for_a_chain_as_for_a_ur() {
    let arm = ArmGeometry::from(seven_joints());
    let down = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), PI);
    let pose_ft = Isometry3::from_parts(Vector3::new(0.0, 0.0, 0.15).into(), down);
    let (lowest, highest) = (Point3::new(-1.0, -1.0, -1.0), Point3::new(1.5, 1.0, 1.5));
    let limits = Limits {
        lowest,
        highest,
        ..Limits::default()
    };
    let check = |place: [f64; 3], near: &Joints| {
        limits.check_pose(
            &arm,
            &pose_ft,
            &Isometry3::translation(place[0], place[1], place[2]),
            near,
        )
    };
    let start = Isometry3::translation(0.5, 0.0, 0.1);
    let near = arm.most_dexterous(&(start * pose_ft.inverse())).unwrap();
    assert!(check([0.5, 0.0, 0.1], &near).is_ok());
    let refused = check([1.4, 0.0, 0.1], &near).unwrap_err();
    assert!(
        matches!(
            refused,
            LimitError::Reach { .. } | LimitError::JointRange { .. }
        ),
        "{refused}"
    );
    let refused = check([0.5, 0.0, 0.1], &[0.0; 6].into()).unwrap_err();
    assert_eq!(
        refused.to_string(),
        "the arm has 6 joints, the one of robot.model has 7: name the arm that is there"
    );
    // stretched it cannot go farther out
    let ur = UrGeometry::UR5E;
    let stretched = Joints::from([0.3, -1.2, 0.0, -0.9, 1.1, 0.4]);
    let refused = limits
        .check_pose(
            &ur_chain(&ur, 0.05).into(),
            &pose_ft,
            &(ArmGeometry::from(ur).flange(&stretched) * pose_ft),
            &stretched,
        )
        .unwrap_err();
    assert!(
        matches!(refused, LimitError::Singular { dexterity, .. } if dexterity < 1e-6),
        "{refused}"
    );
}

/// By the matrices the flange is in the column of the base, 110 mm thick.
#[test]
#[ignore = "a slow proof"]
fn links_of_a_chain_that_meet_are_named() {
    let arm = ArmGeometry::from(seven_joints());
    let probe = Isometry3::translation(0.0, 0.0, 0.15);
    let pair = |joints: &Joints| ArmBodies::new(&arm, joints, &probe).nearest_pair();
    let (_, _, gap) = pair(&[0.0, -0.3, 0.0, -1.9, 0.0, 1.8, 0.8].into());
    assert!(gap > 0.02, "{gap}");
    let mut rng = Pcg64::seed_from_u64(8);
    let somewhere = (0..1_000_000).map(|_| in_range([(); 7].map(|()| rng.random_range(0.0..1.0))));
    let is_in_base = |joints: &Joints| {
        let flange = by_matrices(joints);
        flange[(0, 3)].hypot(flange[(1, 3)]) < 0.03 && (0.1..0.3).contains(&flange[(2, 3)])
    };
    let mut found = somewhere.filter(is_in_base).take(5).peekable();
    assert!(found.peek().is_some());
    for joints in found {
        let (one, other, gap) = pair(&joints);
        assert!(gap < -0.02, "{one} {other} {gap}");
        assert!(
            [&one, &other]
                .iter()
                .any(|link| matches!(link, Link::Named(name) if name.starts_with("link")))
        );
    }
}

#[test]
fn what_is_no_arm_is_refused_by_name() {
    let chain = seven_joints();
    let links = |count: usize| -> Vec<_> {
        (0..count)
            .map(|number| ChainLink {
                name: format!("l{number}").into(),
                body: None,
            })
            .collect()
    };
    let of = |joints: Vec<ChainJoint>, count| {
        SerialChain::new(
            joints,
            links(count),
            Isometry3::translation(0.0, 0.0, 0.1),
            0.05,
        )
    };
    let joints = chain.joints().to_vec();
    assert_eq!(
        of(joints[..5].to_vec(), 6),
        Err(ChainError::Count { count: 5 })
    );
    assert_eq!(
        of(joints.clone(), 7),
        Err(ChainError::Links { count: 7, links: 7 })
    );
    let mut twice = joints.clone();
    twice[3].name = twice[1].name.clone();
    assert_eq!(
        of(twice, 8).unwrap_err().to_string(),
        "joint joint2: another has the same name"
    );
    let mut narrow = joints;
    narrow[2].range = Some([0.4, 0.4]);
    assert!(
        of(narrow, 8)
            .unwrap_err()
            .to_string()
            .starts_with("joint joint3: its range has no room")
    );
}
