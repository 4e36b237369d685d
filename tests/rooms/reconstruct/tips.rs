//! Flat and cone tips led over the plate that the simulator knows: estimated contacts against true
//! ones.

use nalgebra::{Isometry3, Point3, Vector3};
use touchup::reconstruct::{TipTouch, TouchFinder, TouchFinderParams};
use touchup::sim::{
    PathParams, Plate, RasterDirection, RasterRegion, Stroke, StylusParams, Surface, TrueState,
    plan_demo, raster, touch,
};
use touchup::stylus::{
    ContactEstimator, ContactEstimatorParams, SyncParams, Synchroniser, TipBody, TipParams,
    TipPlace, TipShape,
};

const FLAT: TipShape = TipShape::Flat {
    edge_radius: 0.2e-3,
    length: 6e-3,
};
const CONE: TipShape = TipShape::Cone {
    half_angle: 0.35,
    length: 6e-3,
};

/// A ball or a flat end goes over the plate as in the demo; a cone only so deep into holes that it
/// does not get stuck.
fn path(stylus: &StylusParams, hand: &PathParams) -> Vec<Stroke> {
    let plate = Plate::default();
    if !matches!(stylus.shape, TipShape::Cone { .. }) {
        return plan_demo(&plate, hand).unwrap();
    }
    let region = RasterRegion {
        frame_ov: Isometry3::identity(),
        low: [0.009, 0.008].into(),
        high: [0.065, 0.042].into(),
        floor: 8e-3,
        clear: 20e-3,
    };
    raster(&region, RasterDirection::AlongX, hand).unwrap()
}

/// Contacts, with the truth at that time.
fn contacts(stylus: &StylusParams, seed: u64) -> Vec<(TipTouch, TrueState)> {
    let plate = Plate::default();
    let hand = PathParams {
        radius: stylus.radius,
        ..PathParams::default()
    };
    let recording = touch(&plate, &path(stylus, &hand), stylus, seed).unwrap();
    let params = TouchFinderParams {
        shape: stylus.shape,
        ..TouchFinderParams::new(stylus.radius, Some(stylus.stiffness))
    };
    let mut finder = TouchFinder::new(params).unwrap();
    let tip = TipParams {
        radius: stylus.radius,
        stiffness: Some(stylus.stiffness),
    };
    let mut contacts = ContactEstimator::new(ContactEstimatorParams::new(tip)).unwrap();
    let mut sync = Synchroniser::new(SyncParams::default()).unwrap();
    let mut touches = Vec::new();
    for message in &recording.messages {
        sync.push(*message);
        std::iter::from_fn(|| sync.next_sample()).for_each(|sample| {
            finder.push(contacts.observe(&sample).unwrap(), |touch| {
                touches.push(touch)
            })
        });
    }
    finder.flush(|touch| touches.push(touch));
    let truth = |touch: TipTouch| {
        let tick = (touch.stamp_ns - stylus.sensor.start_ns + 500_000) / 1_000_000;
        Some((
            touch,
            recording.moments.get(usize::try_from(tick).ok()?)?.clone(),
        ))
    };
    touches.into_iter().filter_map(truth).collect()
}

fn tips() -> [(&'static str, StylusParams); 6] {
    let with = |shape, radius, tilt: f64| StylusParams {
        shape,
        radius,
        tilt: tilt.to_radians(),
        ..StylusParams::default()
    };
    [
        ("flat of 1.5 mm", with(FLAT, 1.5e-3, 5.0)),
        ("cone of 20°", with(CONE, 0.5e-3, 5.0)),
        ("ball of 1.5 mm", with(TipShape::Ball, 1.5e-3, 5.0)),
        ("flat, upright", with(FLAT, 1.5e-3, 0.0)),
        ("flat, tilt 15°", with(FLAT, 1.5e-3, 15.0)),
        ("cone of 20°, tilt 15°", with(CONE, 0.5e-3, 15.0)),
    ]
}

/// Share of the samples in contact with an estimated place, and for single contacts median and 90th
/// percentile of the distance of their points from the part, mm, and of the error of their normals,
/// degrees.
fn quality(contacts: &[(TipTouch, TrueState)]) -> [f64; 5] {
    let plate = Plate::default();
    let (mut distances, mut angles, mut touching) = (Vec::new(), Vec::new(), 0);
    for (touch, moment) in contacts {
        let [truth] = &moment.contacts[..] else {
            continue;
        };
        touching += 1;
        let Some(contact) = touch.contact else {
            continue;
        };
        distances.push(plate.signed_distance(&contact.point).abs() * 1e3);
        angles.push(angle(&contact.normal, &truth.normal));
    }
    let [median, p90] = quantiles(&mut distances);
    let [angle_median, angle_p90] = quantiles(&mut angles);
    [
        distances.len() as f64 / f64::from(touching),
        median,
        p90,
        angle_median,
        angle_p90,
    ]
}

fn angle(a: &Vector3<f64>, b: &Vector3<f64>) -> f64 {
    a.cross(b).norm().atan2(a.dot(b)).to_degrees()
}

fn quantiles(values: &mut [f64]) -> [f64; 2] {
    values.sort_unstable_by(f64::total_cmp);
    [0.5, 0.9].map(|share| values[(share * (values.len() - 1) as f64) as usize])
}

/// Largest depth of the tip in the part, m.
///
/// - `known`: height of the tip up to which its shape holds, m.
fn depth(stylus: &StylusParams, known: f64, contacts: &[(TipTouch, TrueState)]) -> f64 {
    let plate = Plate::default();
    let body = TipBody::new(stylus.shape, stylus.radius).unwrap();
    let (mut deepest, mut touching) = (0.0f64, 0);
    for (_, moment) in contacts.iter().step_by(50) {
        let place = TipPlace::from(&moment.pose_ot);
        touching += usize::from(!moment.contacts.is_empty());
        // points all over the end of the tip and its side
        for i in 0..600 {
            let turn = f64::from(i) * 2.399_963;
            let lean = f64::from(i) / 600.0 * 1.9;
            let out = Vector3::new(
                turn.cos() * lean.sin(),
                turn.sin() * lean.sin(),
                -lean.cos(),
            );
            let point = body.support(&place, &(moment.pose_ot.rotation * out));
            deepest = deepest.max(-plate.signed_distance(&point));
        }
        let on_tip = |p: &Point3<f64>| {
            (p - place.centre).dot(&place.axis) > known
                || body.signed_distance(&place, p).abs() < 20e-6
        };
        assert!(moment.contacts.iter().all(|contact| on_tip(&contact.point)));
    }
    assert!(touching > 100, "{touching}");
    deepest
}

#[test]
#[ignore = "a slow proof"]
fn contacts_of_a_tip_are_located() {
    println!(
        "{:24} {:>6} {:>14} {:>14}",
        "", "share", "distance, mm", "normal, °"
    );
    for (name, stylus) in &tips() {
        let contacts = contacts(stylus, 1);
        // the tip model ends at 6 mm; the simulated one goes on. The side of a leaning cone enters
        // the rim of the boss 5 to 6 mm up, by 0.116 mm
        let (known, most) = if *name == "cone of 20°, tilt 15°" {
            (5e-3, 0.12e-3)
        } else {
            (6e-3, 8e-6)
        };
        let deepest = depth(stylus, known, &contacts);
        assert!(deepest < most, "{name}: {deepest} m in the part");
        let [share, median, p90, angle_median, angle_p90] = quality(&contacts);
        println!("{name:24} {share:6.2} {median:6.3} {p90:7.3} {angle_median:6.1} {angle_p90:7.1}");
        // noise of 0.05 mm at 500 Hz, averaged over 16 ms and more, and a tenth of the samples at
        // edges and turns
        assert!(share > 0.8 && median < 0.03 && angle_median < 3.0, "{name}");
        // the estimate mistakes the side of a leaning cylinder on the edge of a hole for its end
        let worst = if *name == "flat, tilt 15°" {
            2.0
        } else {
            0.15
        };
        assert!(p90 < worst && angle_p90 < 10.0, "{name}");
    }
}
