//! Markers as `sensor_msgs/msg/PointCloud2`: one point for each, with fields x, y, z and, if the
//! camera identifies markers, `id`.
//!
//! Without `id` a point's place in the cloud is its label. A point that is not finite was
//! invisible. Sizes in a message are compared with the available data before any use.

use std::borrow::Cow;

use nalgebra::Point3;
use serde::{Deserialize, Serialize};

use super::cdr::{HeaderMsg, decode, encode};
use crate::recording::error::BadMessage;
use crate::recording::error::RecordingError;
use crate::scalar::Scalar;
use touchup_method::stylus::{MarkerFrame, MarkerObservation};

/// The message definition, with its field type.
pub(in crate::recording) const POINT_CLOUD: &str = "std_msgs/Header header\nuint32 height\nuint32 width\n\
    sensor_msgs/PointField[] fields\nbool is_bigendian\nuint32 point_step\nuint32 row_step\nuint8[] data\nbool is_dense\n";
pub(in crate::recording) const POINT_FIELD: (&str, &str) = (
    "sensor_msgs/PointField",
    "uint8 INT8=1\nuint8 UINT8=2\nuint8 INT16=3\nuint8 UINT16=4\nuint8 INT32=5\nuint8 UINT32=6\nuint8 FLOAT32=7\n\
     uint8 FLOAT64=8\nstring name\nuint32 offset\nuint8 datatype\nuint32 count\n",
);

const UINT32: u8 = 6;
const FLOAT32: u8 = 7;
/// Size of a written point: x, y, z and id.
const POINT_BYTES: usize = 16;

#[derive(Serialize, Deserialize)]
struct PointFieldMsg<'a> {
    name: Cow<'a, str>,
    offset: u32,
    datatype: u8,
    count: u32,
}

#[derive(Serialize, Deserialize)]
struct PointCloud2Msg<'a> {
    header: HeaderMsg<'a>,
    height: u32,
    width: u32,
    fields: Vec<PointFieldMsg<'a>>,
    is_bigendian: bool,
    point_step: u32,
    row_step: u32,
    data: Vec<u8>,
    is_dense: bool,
}

/// One number of a point.
#[derive(Clone, Copy)]
struct CloudField {
    offset: usize,
    scalar: Scalar,
    is_bigendian: bool,
}

impl CloudField {
    /// `None` when the cloud has no such field, or it does not lie within a point.
    fn of(msg: &PointCloud2Msg, name: &str) -> Option<Self> {
        let field = msg.fields.iter().find(|field| field.name == name)?;
        let scalar = *Scalar::ALL.get(usize::from(field.datatype).checked_sub(1)?)?;
        let offset = usize::try_from(field.offset).ok()?;
        let is_inside = offset.checked_add(scalar.size())? <= msg.point_step as usize;
        is_inside.then_some(Self {
            offset,
            scalar,
            is_bigendian: msg.is_bigendian,
        })
    }

    fn value(&self, point: &[u8]) -> Option<f64> {
        self.scalar
            .value(point.get(self.offset..)?, self.is_bigendian)
    }
}

/// Reads a cloud of markers: frame and markers, of which the first
/// [`touchup_method::stylus::MOST_MARKERS`] present count.
pub(in crate::recording) fn decode_markers(
    payload: &[u8],
) -> Result<(Cow<'_, str>, MarkerFrame), BadMessage> {
    let msg: PointCloud2Msg = decode(payload)?;
    let mut frame = MarkerFrame::new(msg.header.stamp_ns()?);
    read_points(&msg, &mut frame).ok_or(BadMessage::Cloud)?;
    Ok((msg.header.frame_id, frame))
}

/// `None` when the cloud contradicts its header.
fn read_points(msg: &PointCloud2Msg, frame: &mut MarkerFrame) -> Option<()> {
    let [x, y, z] = ["x", "y", "z"].map(|name| CloudField::of(msg, name));
    let (x, y, z) = (x?, y?, z?);
    let id = CloudField::of(msg, "id");
    if id.is_none() && msg.fields.iter().any(|field| field.name == "id") {
        return None;
    }
    let (step, width) = (msg.point_step as usize, msg.width as usize);
    let row = usize::try_from(msg.row_step).ok()?;
    let is_whole =
        step.checked_mul(width)? <= row && row.checked_mul(msg.height as usize)? <= msg.data.len();
    if !is_whole || (row == 0 && msg.height > 0 && width > 0) {
        return None;
    }
    // a row with points has bytes: there are no more rows than data
    let rows = msg.data.chunks_exact(row.max(1)).take(msg.height as usize);
    let points = rows.flat_map(|row| row.chunks_exact(step).take(width));
    for (at, point) in points.enumerate() {
        let position = Point3::new(x.value(point)?, y.value(point)?, z.value(point)?);
        let label = id.map_or(Some(at as f64), |id| id.value(point))?;
        // an invalid label becomes one that no marker has
        frame.see(MarkerObservation {
            label: if label >= 0.0 { label as u32 } else { u32::MAX },
            position,
        });
    }
    Some(())
}

/// Writes a cloud in little-endian CDR; x, y and z as 32 bits, as viewers expect.
pub(in crate::recording) fn encode_markers(
    frame: &MarkerFrame,
    frame_id: &str,
) -> Result<Vec<u8>, RecordingError> {
    let field = |(name, at, datatype): (&'static str, u32, u8)| PointFieldMsg {
        name: name.into(),
        offset: at * 4,
        datatype,
        count: 1,
    };
    let mut data = Vec::with_capacity(frame.seen().len() * POINT_BYTES);
    for marker in frame.seen() {
        marker
            .position
            .iter()
            .for_each(|&x| data.extend((x as f32).to_le_bytes()));
        data.extend(marker.label.to_le_bytes());
    }
    encode(&PointCloud2Msg {
        header: HeaderMsg::new(frame.stamp_ns, frame_id)?,
        height: 1,
        width: frame.seen().len() as u32,
        fields: [
            ("x", 0, FLOAT32),
            ("y", 1, FLOAT32),
            ("z", 2, FLOAT32),
            ("id", 3, UINT32),
        ]
        .map(field)
        .into(),
        is_bigendian: false,
        point_step: POINT_BYTES as u32,
        // at most MOST_MARKERS points
        row_step: data.len() as u32,
        data,
        is_dense: true,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Assembled by hand from the CDR rules, little endian: each number at a multiple of its size
    /// behind the 4 bytes of the encapsulation, strings with length and final zero, sequences with
    /// their count.
    struct Cloud {
        names: Vec<(&'static str, u32, u8)>,
        width: u32,
        height: u32,
        point_step: u32,
        row_step: u32,
        data_len: u32,
        data: Vec<u8>,
    }

    impl Cloud {
        fn of(points: &[([f32; 3], u32)]) -> Self {
            let data: Vec<u8> = points
                .iter()
                .flat_map(|(p, id)| {
                    p.iter()
                        .flat_map(|x| x.to_le_bytes())
                        .chain(id.to_le_bytes())
                })
                .collect();
            let bytes = data.len() as u32;
            Self {
                names: vec![("x", 0, 7), ("y", 4, 7), ("z", 8, 7), ("id", 12, 6)],
                width: points.len() as u32,
                height: 1,
                point_step: 16,
                row_step: bytes,
                data_len: bytes,
                data,
            }
        }

        fn bytes(&self) -> Vec<u8> {
            let mut body = Vec::new();
            let align = |body: &mut Vec<u8>| body.resize(body.len().next_multiple_of(4), 0);
            let number = |body: &mut Vec<u8>, x: u32| body.extend(x.to_le_bytes());
            [7, 9, 2].into_iter().for_each(|x| number(&mut body, x));
            body.extend(b"O\0");
            align(&mut body);
            [self.height, self.width, self.names.len() as u32]
                .into_iter()
                .for_each(|x| number(&mut body, x));
            for (name, offset, datatype) in &self.names {
                number(&mut body, name.len() as u32 + 1);
                body.extend(name.bytes().chain([0]));
                align(&mut body);
                number(&mut body, *offset);
                body.push(*datatype);
                align(&mut body);
                number(&mut body, 1);
            }
            body.push(0);
            align(&mut body);
            [self.point_step, self.row_step, self.data_len]
                .into_iter()
                .for_each(|x| number(&mut body, x));
            body.extend(&self.data);
            body.push(1);
            [&[0, 1, 0, 0], &body[..]].concat()
        }

        fn read(&self) -> Result<MarkerFrame, BadMessage> {
            decode_markers(&self.bytes()).map(|(_, frame)| frame)
        }
    }

    const POINTS: [([f32; 3], u32); 2] = [([1.0, -2.0, 0.5], 3), ([0.25, 0.125, 4.0], 0)];

    fn seen(label: u32, p: [f64; 3]) -> MarkerObservation {
        MarkerObservation {
            label,
            position: p.into(),
        }
    }

    #[test]
    fn the_bytes_laid_out_by_hand_are_read_and_written() {
        let bytes = Cloud::of(&POINTS).bytes();
        let (frame_id, frame) = decode_markers(&bytes).unwrap();
        assert_eq!((frame_id.as_ref(), frame.stamp_ns), ("O", 7_000_000_009));
        assert_eq!(
            frame.seen(),
            [seen(3, [1.0, -2.0, 0.5]), seen(0, [0.25, 0.125, 4.0])]
        );
        assert_eq!(encode_markers(&frame, "O").unwrap(), bytes);
    }

    #[test]
    fn without_an_id_the_place_in_the_cloud_is_the_label_and_nan_is_not_seen() {
        let mut cloud = Cloud::of(&[
            ([1.0; 3], 9),
            ([f32::NAN, 0.0, 0.0], 9),
            ([1e30, 0.0, 0.0], 9),
            ([2.0; 3], 9),
        ]);
        cloud.names.pop();
        assert_eq!(
            cloud.read().unwrap().seen(),
            [seen(0, [1.0; 3]), seen(3, [2.0; 3])]
        );
    }

    #[test]
    fn other_number_types_and_their_order_are_read() {
        let mut cloud = Cloud::of(&[]);
        cloud.names = vec![
            ("id", 0, 3),
            ("z", 8, 8),
            ("y", 16, 8),
            ("x", 24, 8),
            ("rgb", 4, 7),
        ];
        for (id, z) in [(5_i16, 3.0_f64), (-1, 6.0)] {
            cloud.data.extend([&id.to_le_bytes()[..], &[0; 6]].concat());
            [z, 2.0, 1.0]
                .iter()
                .for_each(|x| cloud.data.extend(x.to_le_bytes()));
        }
        // two rows of one point, each with 4 bytes of padding behind it
        cloud.data.splice(32..32, [0; 4]);
        cloud.data.extend([0; 4]);
        (
            cloud.width,
            cloud.height,
            cloud.point_step,
            cloud.row_step,
            cloud.data_len,
        ) = (1, 2, 32, 36, 72);
        assert_eq!(
            cloud.read().unwrap().seen(),
            [seen(5, [1.0, 2.0, 3.0]), seen(u32::MAX, [1.0, 2.0, 6.0])]
        );
    }

    #[test]
    fn sizes_that_lie_are_refused() {
        let lies: [fn(&mut Cloud); 12] = [
            |c| c.width = u32::MAX,
            |c| c.height = u32::MAX,
            |c| (c.width, c.height, c.row_step) = (u32::MAX, u32::MAX, 0),
            |c| (c.width, c.height, c.row_step) = (1, u32::MAX, 16),
            |c| c.point_step = 0,
            |c| c.point_step = 15,
            |c| c.point_step = u32::MAX,
            |c| c.row_step = 16,
            |c| c.names[0].1 = u32::MAX,
            |c| c.names[2].2 = 9,
            |c| c.names[2].2 = 0,
            |c| c.names[1].0 = "height",
        ];
        for (at, lie) in lies.into_iter().enumerate() {
            let mut cloud = Cloud::of(&POINTS);
            lie(&mut cloud);
            assert_eq!(cloud.read().unwrap_err(), BadMessage::Cloud, "lie {at}");
        }
        for len in [33, 1 << 20, u32::MAX] {
            let mut cloud = Cloud::of(&POINTS);
            cloud.data_len = len;
            assert_eq!(
                cloud.read().unwrap_err(),
                BadMessage::Malformed,
                "{len} bytes of data"
            );
        }
    }

    #[test]
    fn every_shortened_payload_is_malformed() {
        let bytes = Cloud::of(&POINTS).bytes();
        for len in 0..bytes.len() {
            assert_eq!(
                decode_markers(&bytes[..len]).unwrap_err(),
                BadMessage::Malformed,
                "{len} bytes"
            );
        }
    }

    #[test]
    fn a_frame_takes_sixteen_of_a_large_cloud() {
        let points: Vec<_> = (0..4000).map(|i| ([i as f32 * 1e-3; 3], i)).collect();
        let frame = Cloud::of(&points).read().unwrap();
        assert_eq!(frame.seen().len(), 16);
    }
}
