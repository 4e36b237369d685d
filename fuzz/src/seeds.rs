//! Seeds: a small sound input of each kind, and recordings around given bytes.

use std::fs;
use std::io::Cursor;
use std::path::Path;

use nalgebra::{Isometry3, Point3, Vector3};
use rusqlite::{Connection, params};
use touchup_io::recording::{Record, RecordingWriter, Topics};
use touchup_method::stylus::{
    MarkerFrame, MarkerObservation, Message, StampedPose, StampedWrench, Wrench,
};
use touchup_session::scene::Scene;

/// Topic of the markers.
pub const MARKERS: &str = "/markers";

/// Topics and types of [`mcap_of`], by their number.
pub const TOPICS: [(&str, &str); 12] = [
    ("/stylus/pose", "geometry_msgs/msg/PoseStamped"),
    ("/stylus/wrench", "geometry_msgs/msg/WrenchStamped"),
    (MARKERS, "sensor_msgs/msg/PointCloud2"),
    ("/tf", "tf2_msgs/msg/TFMessage"),
    ("/tf_static", "tf2_msgs/msg/TFMessage"),
    ("/odometry", "nav_msgs/msg/Odometry"),
    ("/covariance", "geometry_msgs/msg/PoseWithCovarianceStamped"),
    ("/transform", "geometry_msgs/msg/TransformStamped"),
    ("/state", "franka_msgs/msg/FrankaState"),
    ("/bare_pose", "geometry_msgs/msg/Pose"),
    ("/bare_wrench", "geometry_msgs/msg/Wrench"),
    ("/iiwa_pose", "iiwa_msgs/msg/CartesianPose"),
];

const MAGIC: &[u8] = b"\x89MCAP0\r\n";

const OBJ: &str =
    "v 0 0 0\nv 20 0 0\nv 0 20 0\nv 0 0 20\nf 1 3 2\nf 1 2 4\nf 2 3 4/1\nf -2//1 1 -1\n";
const STL: &str = "solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 20 0 0\nvertex 0 20 0\nendloop\nendfacet\n\
                   facet normal 0 0 1\nouter loop\nvertex 20 0 0\nvertex 20 20 0\nvertex 0 20 0\nendloop\nendfacet\nendsolid a\n";
const PLY: &str = "ply\nformat ascii 1.0\nelement vertex 4\nproperty double x\nproperty float y\nproperty float z\nproperty float sigma_mm\n\
                   element face 2\nproperty list uchar int vertex_indices\nend_header\n0 0 0 1\n20 0 0 2\n20 20 0 3\n0 20 1e0 4\n3 0 1 2\n\
                   4 0 1 2 3\n";
const PLY_BINARY: &str = "ply\nformat binary_little_endian 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n\
                          element face 1\nproperty list uchar int vertex_indices\nend_header\n";
const PLY_POINTS: &str = "ply\nformat ascii 1.0\nelement vertex 2\nproperty float x\nproperty float y\nproperty float z\nproperty float nx\n\
                          property float ny\nproperty float nz\nend_header\n0 0 0 0 0 1\n1 0 0 0 1 0\n";
const PCD: &str = "# .PCD v0.7\nVERSION 0.7\nFIELDS x y z rgb\nSIZE 4 4 4 4\nTYPE F F F U\nCOUNT 1 1 1 1\nWIDTH 2\nHEIGHT 1\n\
                   VIEWPOINT 0 0 1 1 0 0 0\nPOINTS 2\nDATA ascii\n1 2 3 9\nnan 5 6 9\n";
const PCD_PACKED: &str = "FIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH 1\nHEIGHT 1\nDATA binary_compressed\n";
const METADATA: &str = "rosbag2_bagfile_information:\n  version: 5\n  storage_identifier: mcap\n  relative_file_paths:\n    - bag_0.mcap\n  \
                        duration: {nanoseconds: 1000000}\n  message_count: 2\n";
const FEATURES: &str = r#"{"features":[{"id":1,"kind":"hole","center_mm":[1,2,3],"axis":[0,0,1],"diameter_mm":8.0,
"form":{"roundness_mm":0.05,"std":{"roundness_mm":0.003},"coverage":1.0,"lobes":[3]}}],"unexplained":0.1,
"relations":[{"kind":"perpendicularity","of":1,"to":2,"perpendicularity_mm":0.01,"std":{"perpendicularity_mm":0.002}}],
"clusters":[{"center_mm":[1,2,3],"vertices":5,"convex":true}]}"#;
const URDF: &str = r#"<robot name="arm"><link name="base"/><link name="l1"><collision><origin xyz="0 0 .1" rpy="0 0 0"/><geometry>
<cylinder radius=".05" length=".3"/></geometry></collision></link><link name="flange"/><joint name="a" type="revolute"><parent link="base"/>
<child link="l1"/><origin xyz="0 0 .2" rpy="0 1 0"/><axis xyz="0 0 1"/><limit lower="-3" upper="3" velocity="1" effort="9"/></joint>
<joint name="b" type="fixed"><parent link="l1"/><child link="flange"/><origin xyz="0 0 .3"/></joint></robot>"#;
const CHECK: &str = r#"{"version":1,"date":"2026-01-02T03:04:05Z","robot_model":"ur5e","passed":true,"failures":[],"warnings":[],
"repeatability_mm":0.02,"repeatability_degrees_of_freedom":40,"growth_mm_per_m":0.1,"tip_radius_mm":1.5,"tip_radius_sigma_mm":0.01}"#;
const PAIRS: &str = "scan_x_mm,scan_y_mm,scan_z_mm,space_x_mm,space_y_mm,space_z_mm,name,sigma_mm\n1,2,3,4,5,6,a,0.1\n# no\n7,8,9,1,2,3,,\n";
const POSES: &str = "qx,qy,qz,qw,fx_n,fy_n,fz_n,tx_nm,ty_nm,tz_nm\n0,0,0,1,1,2,3,0.1,0.2,0.3\n";
const TOUCHES: &str = "0,1000,0,1,2,3,1.5,1,2,1.5,0,0,1,0.01,0.005,1,0\n";
const TOUCH_LINE: &str = r#"{"flag":1,"index":0,"begun_ns":1,"ended_ns":2,"verdict":"clean","accepted":true,"from_mm":[1,2,3],
"approach":[0,0,-1],"search_mm":5.0,"centre_mm":[1,2,3],"sigma_mm":0.01,"deviation_mm":0.1,"speed_mm_per_s":1.0,"tip_radius_mm":1.5,
"largest_force_n":2.0,"curve":[[0,1,2,3]]}"#;

/// Two points of one scan with a pose.
fn e57_bytes() -> Vec<u8> {
    use e57::{E57Writer, Record, RecordValue, Transform};
    let mut bytes = Cursor::new(Vec::new());
    let mut write = || -> e57::Result<()> {
        let mut writer = E57Writer::new(&mut bytes, "file")?;
        let records = vec![
            Record::CARTESIAN_X_F64,
            Record::CARTESIAN_Y_F64,
            Record::CARTESIAN_Z_F64,
        ];
        let mut scan = writer.add_pointcloud("scan", records)?;
        scan.set_transform(Some(Transform::default()));
        for x in [0.0, 1.0] {
            scan.add_point([x, 0.0, 1.0].map(RecordValue::Double).to_vec())?;
        }
        scan.finalize()?;
        writer.finalize()
    };
    write().expect("memory takes it");
    bytes.into_inner()
}

/// An MCAP file without chunks, index and end, its messages on the topics of a touch by their
/// number.
pub fn mcap_of(messages: &[(u16, &[u8])]) -> Vec<u8> {
    let mut file = MAGIC.to_vec();
    record(&mut file, 1, &[&text("ros2"), &text("")]);
    for (id, (topic, kind)) in (0u16..).zip(TOPICS) {
        let schema = id + 1;
        record(
            &mut file,
            3,
            &[
                &schema.to_le_bytes(),
                &text(kind),
                &text("ros2msg"),
                &text(""),
            ],
        );
        record(
            &mut file,
            4,
            &[
                &id.to_le_bytes(),
                &schema.to_le_bytes(),
                &text(topic),
                &text("cdr"),
                &text(""),
            ],
        );
    }
    for (number, (topic, payload)) in (0u32..).zip(messages) {
        let time = (u64::from(number) + 1) * 1_000_000;
        let times = [time.to_le_bytes(), time.to_le_bytes()].concat();
        record(
            &mut file,
            5,
            &[&topic.to_le_bytes(), &number.to_le_bytes(), &times, payload],
        );
    }
    file
}

fn record(file: &mut Vec<u8>, opcode: u8, parts: &[&[u8]]) {
    let body = parts.concat();
    file.push(opcode);
    file.extend((body.len() as u64).to_le_bytes());
    file.extend(body);
}

fn text(text: &str) -> Vec<u8> {
    [&(text.len() as u32).to_le_bytes(), text.as_bytes()].concat()
}

/// A recording by the program's writer.
///
/// # Panics
/// If writing into memory fails.
pub fn mcap_bytes() -> Vec<u8> {
    let topics = Topics {
        markers: Some(MARKERS.into()),
        ..Topics::default()
    };
    let mut writer =
        RecordingWriter::new(Cursor::new(Vec::new()), &topics).expect("memory takes bytes");
    for (stamp_ns, z) in [(1_000_000, 1e-3), (2_000_000, 2e-3)] {
        let pose = StampedPose {
            stamp_ns,
            pose_ot: Isometry3::translation(0.0, 0.0, z),
        };
        let wrench = Wrench {
            force: Vector3::z(),
            torque: Vector3::zeros(),
        };
        let mut markers = MarkerFrame::new(stamp_ns);
        markers.see(MarkerObservation {
            label: 3,
            position: Point3::new(0.0, 0.0, z),
        });
        for entry in [
            Record::from(Message::Pose(pose)),
            Message::Wrench(StampedWrench { stamp_ns, wrench }).into(),
            Record::Markers(Box::new(markers)),
        ] {
            writer.write(entry, "part").expect("memory takes bytes");
        }
    }
    writer.finish().expect("memory takes bytes").into_inner()
}

/// A ROS 1 bag without index: a connection for the pose and one for the wrench, and a message of
/// each.
fn bag_bytes() -> Vec<u8> {
    let fields = |fields: &[(&str, &[u8])]| {
        let field = |(name, value): &(&str, &[u8])| {
            let body = [name.as_bytes(), b"=", value].concat();
            [&(body.len() as u32).to_le_bytes()[..], &body].concat()
        };
        fields.iter().flat_map(field).collect::<Vec<_>>()
    };
    let sized = |bytes: &[u8]| [&(bytes.len() as u32).to_le_bytes()[..], bytes].concat();
    let record = |head: &[(&str, &[u8])], data: &[u8]| [sized(&fields(head)), sized(data)].concat();
    let mut bag = b"#ROSBAG V2.0\n".to_vec();
    bag.extend(record(
        &[
            ("op", &[3]),
            ("index_pos", &[0; 8]),
            ("conn_count", &[0; 4]),
            ("chunk_count", &[0; 4]),
        ],
        b" ",
    ));
    let mut records = Vec::new();
    for (number, (topic, kind), numbers) in [(0u32, TOPICS[0], 7), (1, TOPICS[1], 6)] {
        let (kind, id) = (kind.replace("/msg/", "/"), number.to_le_bytes());
        let about = fields(&[("topic", topic.as_bytes()), ("type", kind.as_bytes())]);
        records.extend(record(
            &[("op", &[7]), ("conn", &id), ("topic", topic.as_bytes())],
            &about,
        ));
        let numbers: Vec<u8> = (1..=numbers)
            .flat_map(|at| f64::from(u8::from(at == numbers)).to_le_bytes())
            .collect();
        let message = [&[0; 12][..], &sized(b"part"), &numbers].concat();
        records.extend(record(
            &[
                ("op", &[2]),
                ("conn", &id),
                ("time", &[1, 0, 0, 0, 2, 0, 0, 0]),
            ],
            &message,
        ));
    }
    let size = (records.len() as u32).to_le_bytes();
    bag.extend(record(
        &[("op", &[5]), ("compression", b"none"), ("size", &size)],
        &records,
    ));
    bag
}

/// Pose, wrench and cloud in CDR.
fn payloads() -> [Vec<u8>; 3] {
    let head = [
        &[0u8, 1, 0, 0][..],
        &1i32.to_le_bytes(),
        &2u32.to_le_bytes(),
        &text("part\0"),
        &[0; 3],
    ]
    .concat();
    let numbers = |numbers: &[f64]| {
        numbers
            .iter()
            .flat_map(|x| x.to_le_bytes())
            .collect::<Vec<_>>()
    };
    let field = |name: &str, offset: u32| {
        let fixed = [
            &offset.to_le_bytes()[..],
            &[7, 0, 0, 0],
            &1u32.to_le_bytes(),
        ]
        .concat();
        [text(name), vec![0; 2], fixed].concat()
    };
    let fields = [field("x\0", 0), field("y\0", 4), field("z\0", 8)].concat();
    let sizes = |sizes: &[u32]| {
        sizes
            .iter()
            .flat_map(|x| x.to_le_bytes())
            .collect::<Vec<_>>()
    };
    let point: Vec<u8> = [1f32, 2.0, 3.0]
        .iter()
        .flat_map(|x| x.to_le_bytes())
        .collect();
    [
        [
            &head[..],
            &[0; 4],
            &numbers(&[1e-3, 2e-3, 3e-3, 0.0, 0.0, 0.0, 1.0]),
        ]
        .concat(),
        [
            &head[..],
            &[0; 4],
            &numbers(&[0.0, 0.0, 2.0, 0.0, 0.0, 0.01]),
        ]
        .concat(),
        [
            &head[..],
            &sizes(&[1, 1, 3]),
            &fields,
            &[0; 4],
            &sizes(&[12, 12, 12]),
            &point,
            &[1],
        ]
        .concat(),
    ]
}

fn database(path: &Path) -> rusqlite::Result<()> {
    let db = Connection::open(path)?;
    db.execute_batch(
        "PRAGMA page_size = 512;
         CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT, type TEXT, serialization_format TEXT, offered_qos_profiles TEXT);
         CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER, timestamp INTEGER, data BLOB);",
    )?;
    for (id, ((name, kind), payload)) in (1i64..).zip(TOPICS.into_iter().zip(payloads())) {
        db.execute(
            "INSERT INTO topics VALUES (?1, ?2, ?3, 'cdr', '')",
            params![id, name, kind],
        )?;
        db.execute(
            "INSERT INTO messages VALUES (?1, ?1, ?2, ?3)",
            params![id, id * 1000, payload],
        )?;
    }
    Ok(())
}

/// Bytes that the targets of numbers read as touches of an ordinary size.
fn numbers(seed: u8) -> Vec<u8> {
    let byte = |k: u32| {
        (k.wrapping_mul(2_654_435_761)
            .wrapping_add(u32::from(seed) * 97)
            >> 13) as u8
    };
    (0..400).map(byte).collect()
}

/// Writes a folder of seeds for each target below `folder`, and for scenes a file of words.
///
/// # Errors
/// Of the files.
///
/// # Panics
/// If SQLite makes no database.
#[expect(clippy::too_many_lines)]
pub fn write(folder: &Path) -> std::io::Result<()> {
    let triangle = [[0f32; 3], [20.0, 0.0, 0.0], [0.0, 20.0, 0.0]].concat();
    let coordinates: Vec<u8> = triangle.iter().flat_map(|x| x.to_le_bytes()).collect();
    let ply_binary = [
        PLY_BINARY.as_bytes(),
        &coordinates,
        &[3],
        &[0, 0, 0, 0, 1, 0, 0, 0, 2, 0, 0, 0],
    ]
    .concat();
    let stl_binary = [
        &[b' '; 80][..],
        &1u32.to_le_bytes(),
        &[0; 12],
        &coordinates,
        &[0; 2],
    ]
    .concat();
    let kind = |kind: u8, bytes: &[u8]| [&[kind], bytes].concat();
    let message = |(topic, payload): (u8, Vec<u8>)| {
        [
            &[topic][..],
            &(payload.len() as u32).to_le_bytes(),
            &payload,
        ]
        .concat()
    };
    let messages: Vec<_> = (0u8..).zip(payloads()).map(message).collect();
    let template = Scene::template();
    let mut scenes: Vec<_> = template
        .split("\n\n")
        .map(|section| without_comments(section).into_bytes())
        .collect();
    scenes.push(b"contact: {}\ntip: {radius_mm: 1.5}\nrefine: {mode: paper}\npatch: {tolerance_mm: 0.04}\nmarkers: {positions_mm: [[0, 0, 0]]}".into());
    let touches = [touchup_io::touches_file::HEADER, "\n", TOUCHES].concat();
    let all: [(&str, Vec<Vec<u8>>); 16] = [
        (
            "mesh",
            vec![
                kind(0, OBJ.as_bytes()),
                kind(1, STL.as_bytes()),
                kind(4, &stl_binary),
                kind(2, PLY.as_bytes()),
                kind(5, &ply_binary),
            ],
        ),
        (
            "cloud",
            vec![
                kind(0, PCD.as_bytes()),
                kind(0, &[PCD_PACKED.as_bytes(), &[14, 0, 0, 0, 12, 0, 0, 0, 11], &[0; 12], &[0]].concat()),
                kind(1, b"# x y z\n1 2 3 0 0 1\n4;5;6;0;1;0\n"),
                kind(2, &e57_bytes()),
                kind(3, PLY_POINTS.as_bytes()),
            ],
        ),
        ("scene", scenes),
        ("recording", vec![mcap_bytes(), mcap_of(&[(0, &payloads()[0]), (1, &payloads()[1]), (2, &payloads()[2])])]),
        ("rosbag2", vec![METADATA.into()]),
        (
            "own_data",
            vec![
                kind(
                    0,
                    b"t_s,x_mm,y_mm,z_mm,qx,qy,qz,qw,fx_n,fy_n,fz_n\n1.5,1,2,3,0,0,0,1,1,2,3\n2,,,,0,0,0,1,1,2,3\n",
                ),
                kind(1, b"t;x;y;z;a;b;c;u;v;w\n1;1;2;3;0;0;90;1;2;3\n"),
                kind(2, &bag_bytes()),
            ],
        ),
        ("messages", vec![messages[0].clone(), messages[1].clone(), messages[2].clone(), messages.concat()]),
        ("table", vec![PAIRS.into(), POSES.into(), touches.into(), TOUCH_LINE.replace('\n', "").into()]),
        ("features", vec![FEATURES.into()]),
        ("urdf", vec![URDF.into()]),
        ("check_record", vec![CHECK.into()]),
        ("step", vec![numbers(1)[..120].into(), numbers(2)[..120].into()]),
        ("synchroniser", vec![numbers(3), numbers(4)]),
        ("refiner", (5..10).map(numbers).collect()),
        ("patcher", (10..14).map(numbers).collect()),
        ("detect", vec![numbers(14)[..200].into(), vec![0]]),
    ];
    for (target, seeds) in all {
        let place = folder.join(target);
        fs::create_dir_all(&place)?;
        for (number, seed) in seeds.iter().enumerate() {
            fs::write(place.join(format!("seed-{number}")), seed)?;
        }
    }
    let path = folder.join("recording/seed-db3");
    let _ = fs::remove_file(&path);
    database(&path).expect("SQLite makes a small database");
    let words = template
        .split(|c: char| !(c.is_alphanumeric() || c == '_'))
        .filter(|word| word.contains('_'));
    fs::write(
        folder.join("scene.dict"),
        words
            .map(|word| format!("\"{word}\"\n"))
            .collect::<String>(),
    )
}

fn without_comments(yaml: &str) -> String {
    let lines = yaml
        .lines()
        .filter(|line| !line.trim_start().starts_with("# ") && !line.trim().is_empty());
    // a setting that is off is on in a seed
    lines.map(|line| line.replacen('#', "", 1) + "\n").collect()
}
