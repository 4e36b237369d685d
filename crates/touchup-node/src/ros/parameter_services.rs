//! The six services of parameters, as for `ros2 param`.
//!
//! Our own: those of the client libraries know neither ranges nor descriptions, and cannot wait for
//! the node's answer.

use std::sync::{Arc, Mutex};

use crate::ros::exchange::{PortState, RosError};
use crate::ros::locked;
use crate::ros::messages::{self, *};
use crate::ros::parameters::{
    PARAMETERS, ParameterDomain, ParameterValue, Parameters, Settable, descriptor,
};
use crate::ros::port::{Arrival, Reply};
use crate::ros::services::{Serves, services};

/// Maximum number of parameters in one call; further ones get no answer.
const MOST_NAMES: usize = 1024;

// numbers of rcl_interfaces/msg/ParameterType
const NOT_SET: u8 = 0;
const BOOL: u8 = 1;
const INTEGER: u8 = 2;
const DOUBLE: u8 = 3;
const STRING: u8 = 4;

/// Publishes a change of a parameter.
type Announce = Box<dyn Fn(&str, &ParameterValue) + Send + Sync>;

/// The public values.
pub(super) struct PublicParameters {
    exchange: Arc<PortState>,
    values: Mutex<Parameters>,
    announce: Announce,
}

services! {
    /// Offers the services.
    fn serve(PublicParameters);
    "~/get_parameters": GetParameters, |held, request, reply| reply.send(get(&locked(&held.values), &request));
    "~/get_parameter_types": GetParameterTypes, |held, request, reply| {
        reply.send(types(&locked(&held.values), &request));
    };
    "~/list_parameters": ListParameters, |_, request, reply| reply.send(list(&request));
    "~/describe_parameters": DescribeParameters, |_, request, reply| reply.send(describe_all(&request));
    "~/set_parameters": SetParameters, |held, request, reply| {
        let wanted = request.parameters.into_iter().take(MOST_NAMES);
        held.clone().set(wanted, Vec::new(), Reply::new(|results| reply.send(SetParametersResponse { results })));
    };
    "~/set_parameters_atomically": SetParametersAtomically, |held, request, reply| {
        held.set_all(request.parameters, reply);
    };
}

impl PublicParameters {
    /// - `announce`: publishes a change of a parameter.
    pub fn new(
        exchange: &Arc<PortState>,
        values: &Parameters,
        announce: impl Fn(&str, &ParameterValue) + Send + Sync + 'static,
    ) -> Arc<Self> {
        let values = Mutex::new(values.clone());
        Arc::new(Self {
            exchange: exchange.clone(),
            values,
            announce: Box::new(announce),
        })
    }

    /// Sets one parameter after the other through the node, and answers after the last.
    fn set(
        self: Arc<Self>,
        mut wanted: impl Iterator<Item = Parameter> + Send + 'static,
        mut results: Vec<SetParametersResult>,
        answer: Reply<Vec<SetParametersResult>>,
    ) {
        // refusals here need no answer of the node
        let (name, value) = loop {
            let Some(next) = wanted.next() else {
                return answer.send(results);
            };
            let checked = check(&locked(&self.values), &next);
            match checked {
                Ok(value) => break (next.name, value),
                Err(reason) => results.push(result(Err(reason))),
            }
        };
        let exchange = self.exchange.clone();
        let (set_name, set_value) = (name.clone(), value.clone());
        let reply = Reply::new(move |set: Result<(), String>| {
            if set.is_ok() {
                // the check came before the request to the node
                let _ = locked(&self.values).set_live(&set_name, &set_value);
                (self.announce)(&set_name, &set_value);
            }
            results.push(result(set));
            self.set(wanted, results, answer);
        });
        exchange
            .inbox
            .put(Arrival::SetParameter(name, value, reply));
    }

    /// Sets all or none, as far as the table of parameters can decide beforehand.
    fn set_all(
        self: &Arc<Self>,
        wanted: Vec<Parameter>,
        reply: Reply<SetParametersAtomicallyResponse>,
    ) {
        let checked = if wanted.len() > MOST_NAMES {
            Err(format!(
                "{} parameters in one call: at most {MOST_NAMES}",
                wanted.len()
            ))
        } else {
            let values = locked(&self.values);
            wanted
                .iter()
                .try_for_each(|parameter| check(&values, parameter).map(drop))
        };
        let all_set = move |results: Vec<SetParametersResult>| {
            let first = results
                .into_iter()
                .find(|one| !one.successful)
                .unwrap_or_else(|| result(Ok(())));
            reply.send(SetParametersAtomicallyResponse { result: first });
        };
        match checked {
            Err(_) => all_set(vec![result(checked)]),
            Ok(()) => self
                .clone()
                .set(wanted.into_iter(), Vec::new(), Reply::new(all_set)),
        }
    }
}

/// Checks a new value; returns it in its own type.
fn check(values: &Parameters, wanted: &Parameter) -> Result<ParameterValue, String> {
    let value = ours(&wanted.value).ok_or("no parameter of this node has a value of this type")?;
    let mut values = values.clone();
    values
        .set_live(&wanted.name, &value)
        .map_err(|error| error.to_string())?;
    values
        .value(&wanted.name)
        .cloned()
        .ok_or_else(|| format!("there is no parameter \"{}\"", wanted.name))
}

fn few(names: &[String]) -> &[String] {
    &names[..names.len().min(MOST_NAMES)]
}

pub(super) fn result(result: Result<(), String>) -> SetParametersResult {
    SetParametersResult {
        successful: result.is_ok(),
        reason: result.err().unwrap_or_default(),
    }
}

pub(super) fn get(values: &Parameters, request: &GetParametersRequest) -> GetParametersResponse {
    GetParametersResponse {
        values: few(&request.names)
            .iter()
            .map(|name| raw(values.value(name)))
            .collect(),
    }
}

fn types(values: &Parameters, request: &GetParameterTypesRequest) -> GetParameterTypesResponse {
    let types = few(&request.names)
        .iter()
        .map(|name| values.value(name).map_or(NOT_SET, type_of));
    GetParameterTypesResponse {
        types: types.collect(),
    }
}

/// Names with one of the prefixes; our names have no dots, so depth has no effect.
pub(super) fn list(request: &ListParametersRequest) -> ListParametersResponse {
    let is_wanted = |name: &str| {
        request.prefixes.is_empty() || request.prefixes.iter().any(|prefix| prefix == name)
    };
    let names = PARAMETERS
        .iter()
        .map(|declared| declared.name.to_owned())
        .filter(|name| is_wanted(name))
        .collect();
    ListParametersResponse {
        result: ListParametersResult {
            names,
            prefixes: Vec::new(),
        },
    }
}

pub(super) fn describe_all(request: &DescribeParametersRequest) -> DescribeParametersResponse {
    DescribeParametersResponse {
        descriptors: few(&request.names)
            .iter()
            .map(|name| describe(name))
            .collect(),
    }
}

fn describe(name: &str) -> messages::ParameterDescriptor {
    let mut described = messages::ParameterDescriptor {
        name: name.to_owned(),
        ..Default::default()
    };
    let Ok(declared) = descriptor(name) else {
        return described;
    };
    described.r#type = type_of(&declared.default_value());
    described.description = declared.description.to_owned();
    described.read_only = declared.settable == Settable::AtStart;
    match declared.allowed {
        ParameterDomain::Double(_, from_value, to_value) => {
            described.floating_point_range = vec![FloatingPointRange {
                from_value,
                to_value,
                step: 0.0,
            }];
        }
        ParameterDomain::OneOf(_, words) => described.additional_constraints = words.join(", "),
        ParameterDomain::Bool(_) | ParameterDomain::String(_) | ParameterDomain::SampleType(_) => {}
    }
    described
}

fn type_of(value: &ParameterValue) -> u8 {
    match value {
        ParameterValue::Bool(_) => BOOL,
        ParameterValue::Integer(_) => INTEGER,
        ParameterValue::Double(_) => DOUBLE,
        ParameterValue::String(_) => STRING,
    }
}

/// Message of a value; `None`: not set.
pub(super) fn raw(value: Option<&ParameterValue>) -> messages::ParameterValue {
    let mut raw = messages::ParameterValue {
        r#type: value.map_or(NOT_SET, type_of),
        ..Default::default()
    };
    match value {
        Some(ParameterValue::Bool(on)) => raw.bool_value = *on,
        Some(ParameterValue::Integer(whole)) => raw.integer_value = *whole,
        Some(ParameterValue::Double(number)) => raw.double_value = *number,
        Some(ParameterValue::String(word)) => raw.string_value = word.clone(),
        None => {}
    }
    raw
}

/// Value of a message; `None` for a type of no parameter here.
fn ours(value: &messages::ParameterValue) -> Option<ParameterValue> {
    match value.r#type {
        BOOL => Some(ParameterValue::Bool(value.bool_value)),
        INTEGER => Some(ParameterValue::Integer(value.integer_value)),
        DOUBLE => Some(ParameterValue::Double(value.double_value)),
        STRING => Some(ParameterValue::String(value.string_value.clone())),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn wanted(name: &str, value: messages::ParameterValue) -> Parameter {
        Parameter {
            name: name.to_owned(),
            value,
        }
    }

    #[test]
    fn a_value_comes_back_as_it_went() {
        let values = [
            ParameterValue::Bool(true),
            ParameterValue::Integer(-3),
            ParameterValue::Double(0.25),
            ParameterValue::String("hole".into()),
        ];
        for (value, number) in values.into_iter().zip(1..) {
            let raw = raw(Some(&value));
            assert_eq!(
                raw.r#type, number,
                "as rcl_interfaces/msg/ParameterType counts them"
            );
            assert_eq!(ours(&raw), Some(value));
        }
        assert_eq!((raw(None).r#type, ours(&raw(None))), (0, None));
    }

    #[test]
    fn a_list_is_refused_and_so_is_what_the_table_refuses() {
        let values = Parameters::default();
        let list = messages::ParameterValue {
            r#type: 8,
            double_array_value: vec![1.0],
            ..raw(None)
        };
        let reason = check(&values, &wanted("view_rate_hz", list)).unwrap_err();
        assert_eq!(reason, "no parameter of this node has a value of this type");
        let high = raw(Some(&ParameterValue::Double(1e3)));
        let reason = check(&values, &wanted("view_rate_hz", high)).unwrap_err();
        assert_eq!(reason, "view_rate_hz is 1000.0: it may be 0.1 to 100");
        let whole = raw(Some(&ParameterValue::Integer(5)));
        assert_eq!(
            check(&values, &wanted("view_rate_hz", whole)),
            Ok(ParameterValue::Double(5.0))
        );
    }

    #[test]
    fn descriptions_have_type_range_words_and_what_is_fixed() {
        let rate = describe("view_rate_hz");
        let range = &rate.floating_point_range[0];
        assert_eq!(
            (
                rate.r#type,
                rate.read_only,
                range.from_value,
                range.to_value
            ),
            (3, false, 0.1, 100.0)
        );
        let robot = describe("robot");
        assert_eq!((robot.r#type, robot.read_only), (4, true));
        assert_eq!(robot.additional_constraints, "none, sim, ur, ros2_control");
        assert_eq!(describe("use_sim_time").r#type, 1);
        assert_eq!(
            (
                describe("nothing").r#type,
                describe("nothing").name.as_str()
            ),
            (0, "nothing")
        );
    }

    #[test]
    fn names_are_listed_all_or_those_that_are_asked_for() {
        let all = list(&ListParametersRequest {
            prefixes: Vec::new(),
            depth: 0,
        })
        .result
        .names;
        assert_eq!(all.len(), PARAMETERS.len());
        let request = ListParametersRequest {
            prefixes: vec!["robot".into(), "none".into()],
            depth: 1,
        };
        assert_eq!(list(&request).result.names, ["robot"]);
    }
}
