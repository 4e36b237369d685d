//! The joints and links of an arm, from its URDF.
//!
//! Used are joints (origin, axis, limits) from a base to a flange, and the collision shapes of
//! links. Poses are T = (xyz, Rz(yaw) Ry(pitch) Rx(roll)), in m and rad, of a joint in the frame of
//! its parent link.

use std::fs::File;
use std::io::Read;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use nalgebra::{Isometry3, Point3, UnitQuaternion, UnitVector3, Vector3};
use roxmltree::{Document, Node};
use touchup_probing::arm::{Capsule, ChainError, ChainJoint, ChainLink, SerialChain};

/// Maximum size of an arm's description, bytes.
const LARGEST: u64 = 16 << 20;

/// Links of interest in a URDF.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ArmLinks<'a> {
    /// name of the link whose frame is the base B
    pub base: &'a str,
    /// name of the link whose frame is the flange F
    pub flange: &'a str,
    /// of links without a simple shape, m
    pub radius: f64,
}

/// Why a URDF is no arm.
#[derive(Debug, thiserror::Error)]
pub enum UrdfError {
    /// A failed read.
    #[error("cannot read the URDF {path}: {source}", path = path.display())]
    Read {
        /// the file
        path: PathBuf,
        /// the system's error
        source: std::io::Error,
    },
    /// Not a URDF of an arm.
    #[error("{path}: {error}", path = path.display())]
    In {
        /// the file
        path: PathBuf,
        /// the fault
        error: DescriptionError,
    },
}

/// A fault of a URDF.
#[derive(Debug, thiserror::Error)]
pub enum DescriptionError {
    /// Too large, or no text.
    #[error("it is no text of at most {} MB", LARGEST >> 20)]
    NoText,
    /// No XML.
    #[error("{0}")]
    Xml(#[from] roxmltree::Error),
    /// An unexpanded macro.
    #[error("it is written for xacro: expand it first, `xacro {0} > arm.urdf`")]
    Xacro(String),
    /// A missing link.
    #[error("there is no link `{name}`; there are {known}")]
    NoLink {
        /// its name
        name: String,
        /// all of them
        known: String,
    },
    /// The flange does not stand on the base.
    #[error(
        "from the link `{flange}` no joints lead down to the link `{base}`: they end at `{end}`"
    )]
    NotConnected {
        /// start of the chain
        flange: String,
        /// its required end
        base: String,
        /// its actual end
        end: String,
    },
    /// An unsupported or missing part.
    #[error("joint `{joint}`, line {line}: {what}")]
    Joint {
        /// name of the joint
        joint: String,
        /// of the file, from 1 on
        line: u32,
        /// the fault
        what: String,
    },
    /// Joints and links that are no arm.
    #[error(transparent)]
    Chain(#[from] ChainError),
}

/// Reads an arm.
///
/// # Errors
/// [`UrdfError`]
pub fn read_urdf(path: &Path, links: &ArmLinks<'_>) -> Result<SerialChain, UrdfError> {
    let mut text = Vec::new();
    let read = File::open(path).and_then(|file| file.take(LARGEST + 1).read_to_end(&mut text));
    read.map_err(|source| UrdfError::Read {
        path: path.to_owned(),
        source,
    })?;
    let text = String::from_utf8(text)
        .ok()
        .filter(|text| text.len() as u64 <= LARGEST);
    let name = path
        .file_name()
        .map_or_else(String::new, |name| name.to_string_lossy().into_owned());
    let chain = text
        .ok_or(DescriptionError::NoText)
        .and_then(|text| chain_of(&text, &name, links));
    chain.map_err(|error| UrdfError::In {
        path: path.to_owned(),
        error,
    })
}

/// The arm of a text.
///
/// - `name`: of its file.
fn chain_of(text: &str, name: &str, links: &ArmLinks<'_>) -> Result<SerialChain, DescriptionError> {
    let document = Document::parse(text)?;
    let robot = document.root_element();
    if robot
        .namespaces()
        .any(|space| space.uri().contains("xacro"))
        && text.contains("xacro:")
    {
        return Err(DescriptionError::Xacro(name.to_owned()));
    }
    let link_of = |name: &str| tagged(robot, "link").find(|it| it.attribute("name") == Some(name));
    for name in [links.base, links.flange] {
        if link_of(name).is_none() {
            let known = tagged(robot, "link").filter_map(|it| it.attribute("name"));
            let known: Vec<_> = known.collect();
            return Err(DescriptionError::NoLink {
                name: name.to_owned(),
                known: known.join(", "),
            });
        }
    }
    let (mut joints, mut pose) = (Vec::new(), Isometry3::identity());
    let mut chain_links = vec![ChainLink {
        name: links.base.into(),
        body: link_of(links.base).and_then(body),
    }];
    for (joint, child) in path_of(robot, links)?.into_iter().rev() {
        pose *= origin(&joint)?;
        if let Some(turning) = turning(&joint, pose)? {
            joints.push(turning);
            chain_links.push(ChainLink {
                name: child.into(),
                body: link_of(child).and_then(body),
            });
            pose = Isometry3::identity();
        }
    }
    Ok(SerialChain::new(joints, chain_links, pose, links.radius)?)
}

fn tagged<'a, 'b>(node: Node<'a, 'b>, tag: &str) -> impl Iterator<Item = Node<'a, 'b>> {
    node.children().filter(move |child| child.has_tag_name(tag))
}

/// Joints from the flange down to the base, each with its child.
fn path_of<'a, 'b>(
    robot: Node<'a, 'b>,
    links: &ArmLinks<'a>,
) -> Result<Vec<(Node<'a, 'b>, &'a str)>, DescriptionError> {
    let (mut path, mut at) = (Vec::new(), links.flange);
    while at != links.base {
        // a link is the child of one joint: a circular walk meets all of them
        let below = tagged(robot, "joint")
            .find(|joint| linked(joint, "child") == Some(at))
            .filter(|_| path.len() < MOST_JOINTS);
        let parent = below.and_then(|joint| Some((joint, linked(&joint, "parent")?)));
        let Some((joint, parent)) = parent else {
            let [flange, base, end] = [links.flange, links.base, at].map(str::to_owned);
            return Err(DescriptionError::NotConnected { flange, base, end });
        };
        path.push((joint, at));
        at = parent;
    }
    Ok(path)
}

/// Maximum number of joints between base and flange, including fixed ones.
const MOST_JOINTS: usize = 256;

fn linked<'a>(joint: &Node<'a, '_>, tag: &str) -> Option<&'a str> {
    part(joint, tag)?.attribute("link")
}

fn part<'a, 'b>(node: &Node<'a, 'b>, tag: &str) -> Option<Node<'a, 'b>> {
    tagged(*node, tag).next()
}

fn fault(joint: &Node<'_, '_>, what: impl Into<String>) -> DescriptionError {
    let line = joint.document().text_pos_at(joint.range().start).row;
    DescriptionError::Joint {
        joint: joint.attribute("name").unwrap_or_default().to_owned(),
        line,
        what: what.into(),
    }
}

/// Numbers of an attribute; `None` for an attribute of another form.
fn numbers<const N: usize>(
    node: Option<Node<'_, '_>>,
    key: &str,
    default: [f64; N],
) -> Option<[f64; N]> {
    let Some(text) = node.and_then(|node| node.attribute(key)) else {
        return Some(default);
    };
    let parsed = text
        .split_whitespace()
        .map(|word| word.parse().ok().filter(|x: &f64| x.is_finite()));
    parsed.collect::<Option<Vec<f64>>>()?.try_into().ok()
}

fn pose_of(node: &Node<'_, '_>) -> Option<Isometry3<f64>> {
    let origin = part(node, "origin");
    let ([x, y, z], [roll, pitch, yaw]) = (
        numbers(origin, "xyz", [0.0; 3])?,
        numbers(origin, "rpy", [0.0; 3])?,
    );
    Some(Isometry3::from_parts(
        Vector3::new(x, y, z).into(),
        UnitQuaternion::from_euler_angles(roll, pitch, yaw),
    ))
}

fn origin(joint: &Node<'_, '_>) -> Result<Isometry3<f64>, DescriptionError> {
    pose_of(joint).ok_or_else(|| {
        fault(
            joint,
            "its origin is not three numbers of xyz and three of rpy",
        )
    })
}

/// A turning joint; `None` for a fixed one.
fn turning(
    joint: &Node<'_, '_>,
    origin: Isometry3<f64>,
) -> Result<Option<ChainJoint>, DescriptionError> {
    let kind = joint.attribute("type").unwrap_or_default();
    let range = match kind {
        "fixed" => return Ok(None),
        "continuous" => None,
        "revolute" => {
            let limit = part(joint, "limit");
            let [low, high] = ["lower", "upper"].map(|key| numbers(limit, key, [f64::NAN]));
            match (low, high) {
                (Some([low]), Some([high])) if low < high => Some([low, high]),
                _ => {
                    return Err(fault(
                        joint,
                        "it is revolute and has no limit with lower below upper, in rad",
                    ));
                }
            }
        }
        other => {
            let what = format!(
                "it is of type `{other}`: between base and flange there may be revolute, continuous and fixed joints"
            );
            return Err(fault(joint, what));
        }
    };
    if part(joint, "mimic").is_some() {
        return Err(fault(
            joint,
            "it mimics another: each joint of the arm has to be its own",
        ));
    }
    let axis = numbers(part(joint, "axis"), "xyz", [1.0, 0.0, 0.0]).map(Vector3::from);
    let axis = axis
        .and_then(|axis| UnitVector3::try_new(axis, 1e-6))
        .ok_or_else(|| fault(joint, "its axis is no direction"))?;
    let name: Arc<str> = joint.attribute("name").unwrap_or_default().into();
    Ok(Some(ChainJoint {
        name,
        origin,
        axis,
        range,
    }))
}

/// The capsule around a link's collision shape, in its frame, if the shape is single and no mesh.
fn body(link: Node<'_, '_>) -> Option<Capsule> {
    let mut shapes = link
        .children()
        .filter(|child| child.has_tag_name("collision"));
    let (shape, None) = (shapes.next()?, shapes.next()) else {
        return None;
    };
    let geometry = part(&shape, "geometry")?
        .children()
        .find(Node::is_element)?;
    let number = |key| numbers(Some(geometry), key, [f64::NAN]).map(|[number]| number);
    let (half, radius) = match geometry.tag_name().name() {
        "sphere" => (Vector3::zeros(), number("radius")?),
        "cylinder" | "capsule" => (Vector3::z() * (number("length")? / 2.0), number("radius")?),
        "box" => {
            let size = Vector3::from(numbers(Some(geometry), "size", [f64::NAN; 3])?);
            let (longest, along) = size.argmax();
            let mut half = Vector3::zeros();
            half[longest] = along / 2.0;
            (half, (size.norm_squared() - along * along).sqrt() / 2.0)
        }
        _ => return None,
    };
    let (pose, is_shape) = (
        pose_of(&shape)?,
        half.iter().all(|x| x.is_finite()) && radius > 0.0,
    );
    is_shape.then(|| Capsule {
        ends: [-half, half].map(|end| pose * Point3::from(end)),
        radius,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use touchup_probing::arm::{ArmGeometry, UrGeometry};

    /// A UR5e as its driver describes it, in ROS's frames: joints about z, each at the end of the
    /// one before.
    const UR5E: &str = r#"<robot name="ur5e">
        <link name="base_link"/><link name="base"/><link name="l1"/><link name="l2"><collision>
          <origin xyz="-0.2 0 0.138" rpy="0 1.5707963267948966 0"/><geometry><cylinder radius="0.06" length="0.4"/></geometry>
        </collision></link><link name="l3"/><link name="l4"/><link name="l5"/><link name="l6"/><link name="tool0"/>
        <joint name="base_fixed" type="fixed"><parent link="base_link"/><child link="base"/></joint>
        <joint name="pan" type="revolute"><parent link="base"/><child link="l1"/><origin xyz="0 0 0.1625"/><axis xyz="0 0 1"/>
          <limit lower="-6.28" upper="6.28" velocity="3" effort="1"/></joint>
        <joint name="lift" type="revolute"><parent link="l1"/><child link="l2"/><origin rpy="1.5707963267948966 0 0"/><axis xyz="0 0 2"/>
          <limit lower="-6.28" upper="6.28" velocity="3" effort="1"/></joint>
        <joint name="elbow" type="revolute"><parent link="l2"/><child link="l3"/><origin xyz="-0.425 0 0"/><axis xyz="0 0 1"/>
          <limit lower="-3.1" upper="3.1" velocity="3" effort="1"/></joint>
        <joint name="w1" type="revolute"><parent link="l3"/><child link="l4"/><origin xyz="-0.3922 0 0.1333"/><axis xyz="0 0 1"/>
          <limit lower="-6.28" upper="6.28" velocity="3" effort="1"/></joint>
        <joint name="w2" type="revolute"><parent link="l4"/><child link="l5"/><origin xyz="0 -0.0997 0" rpy="1.5707963267948966 0 0"/>
          <axis xyz="0 0 1"/><limit lower="-6.28" upper="6.28" velocity="3" effort="1"/></joint>
        <joint name="w3" type="continuous"><parent link="l5"/><child link="l6"/><origin xyz="0 0.0996 0" rpy="-1.5707963267948966 0 0"/>
          <axis xyz="0 0 1"/></joint>
        <joint name="flange" type="fixed"><parent link="l6"/><child link="tool0"/></joint>
      </robot>"#;
    const LINKS: ArmLinks<'_> = ArmLinks {
        base: "base_link",
        flange: "tool0",
        radius: 0.05,
    };

    fn error_of(text: &str, links: &ArmLinks<'_>) -> String {
        chain_of(text, "arm.xacro", links).unwrap_err().to_string()
    }

    /// The same arm by the maker's rows of Denavit and Hartenberg.
    #[test]
    fn the_flange_of_a_described_ur_is_where_the_makers_rows_have_it() {
        let chain = chain_of(UR5E, "", &LINKS).unwrap();
        let names: Vec<_> = chain.joints().iter().map(|joint| &*joint.name).collect();
        assert_eq!(names, ["pan", "lift", "elbow", "w1", "w2", "w3"]);
        assert_eq!(chain.joints()[2].range, Some([-3.1, 3.1]));
        assert_eq!(chain.joints()[5].range, None);
        let (arm, ur) = (
            ArmGeometry::from(chain),
            ArmGeometry::from(UrGeometry::UR5E),
        );
        for joints in [
            [0.0; 6],
            [0.3, -1.2, 1.4, -0.9, 1.1, 0.4],
            [-2.0, 0.4, -1.1, 2.2, -0.7, 3.0],
        ] {
            let difference = arm.flange(&joints.into()).to_homogeneous()
                - ur.flange(&joints.into()).to_homogeneous();
            assert!(difference.norm() < 1e-12, "{joints:?}: {difference}");
        }
    }

    #[test]
    fn a_link_with_one_simple_shape_has_its_body_and_others_lie_between_their_joints() {
        let document = Document::parse(UR5E).unwrap();
        let link = |name| {
            document
                .descendants()
                .find(|node| node.has_tag_name("link") && node.attribute("name") == Some(name))
        };
        let body = body(link("l2").unwrap()).unwrap();
        // a cylinder of 400 mm along −x, 138 mm beside the shoulder
        let [a, b] = body.ends.map(|end| end.coords);
        assert!(
            (a - Vector3::new(-0.4, 0.0, 0.138)).norm() < 1e-12
                && (b - Vector3::new(0.0, 0.0, 0.138)).norm() < 1e-12
        );
        assert_eq!(body.radius, 0.06);
        assert!(super::body(link("l3").unwrap()).is_none());
        let boxed = r#"<link name="a"><collision><geometry><box size="0.03 0.04 0.2"/></geometry></collision></link>"#;
        let boxed = super::body(Document::parse(boxed).unwrap().root_element()).unwrap();
        assert!(
            (boxed.radius - 0.025).abs() < 1e-15 && boxed.ends[1] == Point3::new(0.0, 0.0, 0.1)
        );
    }

    #[test]
    fn what_is_no_arm_is_refused_with_name_and_line() {
        let wrong = |from: &str, to: &str| error_of(&UR5E.replacen(from, to, 1), &LINKS);
        let prismatic = wrong(
            r#"name="elbow" type="revolute""#,
            r#"name="elbow" type="prismatic""#,
        );
        assert!(
            prismatic.starts_with("joint `elbow`, line 10: it is of type `prismatic`"),
            "{prismatic}"
        );
        assert!(
            wrong(r#"lower="-3.1""#, "")
                .contains("joint `elbow`, line 10: it is revolute and has no limit")
        );
        assert!(
            wrong(r#"<axis xyz="0 0 2"/>"#, r#"<axis xyz="0 0"/>"#)
                .contains("joint `lift`, line 8: its axis")
        );
        assert!(
            wrong(r#"<parent link="l3"/>"#, r#"<parent link="nowhere"/>"#)
                .contains("they end at `nowhere`")
        );
        assert!(
            wrong(r#"<parent link="base"/>"#, r#"<parent link="tool0"/>"#)
                .contains("no joints lead down")
        );
        let none = error_of(
            UR5E,
            &ArmLinks {
                flange: "flange",
                ..LINKS
            },
        );
        assert!(
            none.starts_with("there is no link `flange`; there are base_link, base, l1"),
            "{none}"
        );
        let short = error_of(
            UR5E,
            &ArmLinks {
                flange: "l4",
                ..LINKS
            },
        );
        assert!(short.starts_with("the arm has 4 turning joints"), "{short}");
        let macros = r#"<robot xmlns:xacro="http://www.ros.org/wiki/xacro"><xacro:include filename="a"/></robot>"#;
        assert!(error_of(macros, &LINKS).contains("`xacro arm.xacro > arm.urdf`"));
        let crossed = error_of("<robot>\n<link></joint></robot>", &LINKS);
        assert!(crossed.contains("2:"), "{crossed}");
        assert!(
            read_urdf(Path::new("/nowhere/arm.urdf"), &LINKS)
                .unwrap_err()
                .to_string()
                .starts_with("cannot read the URDF")
        );
    }
}
