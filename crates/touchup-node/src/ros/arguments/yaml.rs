//! Parameter files: nodes, `ros__parameters`, values.

use std::fmt;

use serde::de::{Deserialize, Deserializer, MapAccess, SeqAccess, Visitor};

use crate::ros::parameters::ParameterValue;

/// A piece of YAML, in the order of the file.
enum YamlPiece {
    Value(ParameterValue),
    Map(Vec<(String, YamlPiece)>),
    List,
    Nothing,
}

const INNER: &str = "ros__parameters";

/// Node pattern, name and value of every parameter in a file. Dots join the names of nested
/// parameters.
pub(super) fn entries(text: &str) -> Result<Vec<(String, String, ParameterValue)>, String> {
    // an empty file is valid
    let piece: Option<YamlPiece> =
        serde_saphyr::from_str(text).map_err(|error| error.to_string())?;
    let mut found = Vec::new();
    match piece {
        None | Some(YamlPiece::Nothing) => {}
        Some(YamlPiece::Map(nodes)) => {
            for (key, below) in nodes {
                nodes_below(&key, below, &mut found)?;
            }
        }
        Some(_) => {
            return Err(format!(
                "it must be nodes, each with {INNER}, as config/node.yaml is"
            ));
        }
    }
    Ok(found)
}

fn nodes_below(
    path: &str,
    piece: YamlPiece,
    found: &mut Vec<(String, String, ParameterValue)>,
) -> Result<(), String> {
    let YamlPiece::Map(entries) = piece else {
        return Err(format!(
            "\"{path}\" is no node: below it must be {INNER}, or a node"
        ));
    };
    for (key, below) in entries {
        if key == INNER {
            parameters_below(path, "", below, found);
        } else {
            nodes_below(&format!("{path}/{key}"), below, found)?;
        }
    }
    Ok(())
}

fn parameters_below(
    nodes: &str,
    prefix: &str,
    piece: YamlPiece,
    found: &mut Vec<(String, String, ParameterValue)>,
) {
    match piece {
        YamlPiece::Map(entries) => {
            for (key, below) in entries {
                let name = if prefix.is_empty() {
                    key
                } else {
                    format!("{prefix}.{key}")
                };
                parameters_below(nodes, &name, below, found);
            }
        }
        YamlPiece::Value(value) => found.push((nodes.to_owned(), prefix.to_owned(), value)),
        // no parameter of this node is a list: either an invalid word, or for another node
        YamlPiece::List => found.push((
            nodes.to_owned(),
            prefix.to_owned(),
            ParameterValue::String("[...]".to_owned()),
        )),
        YamlPiece::Nothing => {}
    }
}

impl<'de> Deserialize<'de> for YamlPiece {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(PieceVisitor)
    }
}

struct PieceVisitor;

impl<'de> Visitor<'de> for PieceVisitor {
    type Value = YamlPiece;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a value, a list or keys with values")
    }

    fn visit_bool<E>(self, value: bool) -> Result<YamlPiece, E> {
        Ok(YamlPiece::Value(ParameterValue::Bool(value)))
    }

    fn visit_i64<E>(self, value: i64) -> Result<YamlPiece, E> {
        Ok(YamlPiece::Value(ParameterValue::Integer(value)))
    }

    fn visit_u64<E>(self, value: u64) -> Result<YamlPiece, E> {
        Ok(YamlPiece::Value(i64::try_from(value).map_or(
            ParameterValue::Double(value as f64),
            ParameterValue::Integer,
        )))
    }

    fn visit_f64<E>(self, value: f64) -> Result<YamlPiece, E> {
        Ok(YamlPiece::Value(ParameterValue::Double(value)))
    }

    fn visit_str<E>(self, value: &str) -> Result<YamlPiece, E> {
        Ok(YamlPiece::Value(ParameterValue::String(value.to_owned())))
    }

    fn visit_unit<E>(self) -> Result<YamlPiece, E> {
        Ok(YamlPiece::Nothing)
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut items: A) -> Result<YamlPiece, A::Error> {
        while items.next_element::<YamlPiece>()?.is_some() {}
        Ok(YamlPiece::List)
    }

    fn visit_map<A: MapAccess<'de>>(self, mut entries: A) -> Result<YamlPiece, A::Error> {
        let mut map = Vec::new();
        while let Some(entry) = entries.next_entry()? {
            map.push(entry);
        }
        Ok(YamlPiece::Map(map))
    }
}
