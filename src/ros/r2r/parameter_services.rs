//! The six services of parameters, as `ros2 param` calls them.
//!
//! Own ones, since those of r2r know nothing of ranges, describe nothing as fixed, and cannot wait for the node's answer.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use r2r::qos::QosProfile;
use r2r::rcl_interfaces::msg as rcl;
use r2r::rcl_interfaces::srv::{
    DescribeParameters, GetParameterTypes, GetParameters, ListParameters, SetParameters, SetParametersAtomically,
};
use r2r::{Node, Publisher, WrappedServiceTypeSupport, builtin_interfaces};

use super::convert::Convert;
use super::services::server;
use super::{During, PollSource, R2rShared, RosError};
use crate::ros::arguments::NodeConfig;
use crate::ros::parameters::{Allowed, PARAMETERS, ParameterValue, Parameters, descriptor};
use crate::ros::port::{Arrival, Reply};

/// Parameters that one call may name; beyond that it is answered short.
const MOST_NAMES: usize = 1024;

// the numbers of rcl_interfaces/msg/ParameterType
const NOT_SET: u8 = 0;
const BOOL: u8 = 1;
const INTEGER: u8 = 2;
const DOUBLE: u8 = 3;
const STRING: u8 = 4;

/// The values as others see them.
struct R2rParameters {
    shared: Arc<R2rShared>,
    node_name: String,
    values: Mutex<Parameters>,
    events: Mutex<Publisher<rcl::ParameterEvent>>,
}

type SetResults = Vec<Result<(), String>>;
type SetReply = Box<dyn FnOnce(SetResults) + Send>;

/// The servers.
pub(super) fn servers(
    config: &NodeConfig,
    node: &mut Node,
    shared: &Arc<R2rShared>,
) -> Result<Vec<PollSource>, RosError> {
    let events = node.create_publisher("/parameter_events", QosProfile::parameter_events());
    let held = Arc::new(R2rParameters {
        shared: shared.clone(),
        node_name: config.place.full_name(),
        values: Mutex::new(config.parameters.clone()),
        events: Mutex::new(events.during("publishing a topic")?),
    });
    let [for_get, for_types, for_set, for_all] = std::array::from_fn(|_| held.clone());
    let set = move |request: SetParameters::Request, reply: Reply<SetParameters::Response>| {
        let answer = move |results: SetResults| {
            reply.send(SetParameters::Response { results: results.into_iter().map(result).collect() });
        };
        for_set.set(request.parameters, Box::new(answer));
    };
    let set_all = move |request: SetParametersAtomically::Request, reply| for_all.set_all(request.parameters, reply);
    Ok(vec![
        answered::<GetParameters::Service>(node, "~/get_parameters", shared, move |request| GetParameters::Response {
            values: few(&request.names).iter().map(|name| for_get.raw(name)).collect(),
        })?,
        answered::<GetParameterTypes::Service>(node, "~/get_parameter_types", shared, move |request| {
            let types = few(&request.names).iter().map(|name| for_types.raw(name).type_).collect();
            GetParameterTypes::Response { types }
        })?,
        answered::<ListParameters::Service>(node, "~/list_parameters", shared, |request| list(&request))?,
        answered::<DescribeParameters::Service>(node, "~/describe_parameters", shared, |request| {
            DescribeParameters::Response {
                descriptors: few(&request.names).iter().map(|name| describe(name)).collect(),
            }
        })?,
        server::<SetParameters::Service, _>(node, "~/set_parameters", shared, set)?,
        server::<SetParametersAtomically::Service, _>(node, "~/set_parameters_atomically", shared, set_all)?,
    ])
}

/// A service that needs nobody to answer.
fn answered<T>(
    node: &mut Node,
    name: &'static str,
    shared: &Arc<R2rShared>,
    answer: impl Fn(T::Request) -> T::Response + Send + 'static,
) -> Result<PollSource, RosError>
where
    T: WrappedServiceTypeSupport + 'static,
    T::Response: Convert<T::Response> + Send,
{
    server::<T, T::Response>(node, name, shared, move |request, reply| reply.send(answer(request)))
}

macro_rules! as_it_is {
    ($($service:ident),+) => {
        $(impl Convert<$service::Response> for $service::Response {
            fn convert(self) -> $service::Response {
                self
            }
        })+
    };
}
as_it_is!(GetParameters, GetParameterTypes, ListParameters, DescribeParameters, SetParameters, SetParametersAtomically);

impl R2rParameters {
    fn values(&self) -> MutexGuard<'_, Parameters> {
        // nothing of ours panics while it holds it
        self.values.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn raw(&self, name: &str) -> rcl::ParameterValue {
        raw(self.values().value(name))
    }

    /// Asks the node for one after the other, and answers when all are done.
    fn set(self: &Arc<Self>, wanted: Vec<rcl::Parameter>, answer: SetReply) {
        let wanted: Vec<_> = wanted.into_iter().take(MOST_NAMES).collect();
        self.clone().set_next(wanted.into_iter(), Vec::new(), answer);
    }

    fn set_next(
        self: Arc<Self>,
        mut wanted: std::vec::IntoIter<rcl::Parameter>,
        mut results: SetResults,
        answer: SetReply,
    ) {
        // what is refused here needs no answer of the node
        let (name, value) = loop {
            let Some(next) = wanted.next() else { return answer(results) };
            let checked = check(&self.values(), &next);
            match checked {
                Ok(value) => break (next.name, value),
                Err(reason) => results.push(Err(reason)),
            }
        };
        let shared = self.shared.clone();
        let (set_name, set_value) = (name.clone(), value.clone());
        let reply = Reply::new(move |result: Result<(), String>| {
            if result.is_ok() {
                self.keep(&set_name, &set_value);
            }
            results.push(result);
            self.set_next(wanted, results, answer);
        });
        shared.arrivals.put(Arrival::SetParameter(name, value, reply));
    }

    /// All or none, as far as the table of parameters can tell before any is set.
    fn set_all(self: &Arc<Self>, wanted: Vec<rcl::Parameter>, reply: Reply<SetParametersAtomically::Response>) {
        let answer = move |results: SetResults| {
            let first = results.into_iter().find(Result::is_err).unwrap_or(Ok(()));
            reply.send(SetParametersAtomically::Response { result: result(first) });
        };
        let refused = if wanted.len() > MOST_NAMES {
            Some(format!("{} parameters in one call: at most {MOST_NAMES}", wanted.len()))
        } else {
            let values = self.values();
            wanted.iter().find_map(|parameter| check(&values, parameter).err())
        };
        match refused {
            Some(reason) => answer(vec![Err(reason)]),
            None => self.set(wanted, Box::new(answer)),
        }
    }

    /// Keeps what the node took, and announces it.
    fn keep(self: &Arc<Self>, name: &str, value: &ParameterValue) {
        // it was checked before the node was asked
        let _ = self.values().set_live(name, value);
        let stamp_ns = self.shared.clock.now_ns();
        let event = rcl::ParameterEvent {
            stamp: builtin_interfaces::msg::Time {
                sec: (stamp_ns / 1_000_000_000) as i32,
                nanosec: (stamp_ns % 1_000_000_000) as u32,
            },
            node: self.node_name.clone(),
            new_parameters: Vec::new(),
            changed_parameters: vec![rcl::Parameter { name: name.to_owned(), value: raw(Some(value)) }],
            deleted_parameters: Vec::new(),
        };
        let held = self.clone();
        self.shared.urgent.answer(Box::new(move || {
            let events = held.events.lock().unwrap_or_else(PoisonError::into_inner);
            if let Err(error) = events.publish(&event) {
                tracing::warn!(%error, "a change of a parameter is not announced");
            }
        }));
    }
}

/// The value as it is to be set, if it may be.
fn check(values: &Parameters, wanted: &rcl::Parameter) -> Result<ParameterValue, String> {
    let value = ours(&wanted.value).ok_or("no parameter of this node has a value of this type")?;
    let mut values = values.clone();
    values.set_live(&wanted.name, &value).map_err(|error| error.to_string())?;
    values.value(&wanted.name).cloned().ok_or_else(|| format!("there is no parameter \"{}\"", wanted.name))
}

fn few(names: &[String]) -> &[String] {
    &names[..names.len().min(MOST_NAMES)]
}

fn result(result: Result<(), String>) -> rcl::SetParametersResult {
    rcl::SetParametersResult { successful: result.is_ok(), reason: result.err().unwrap_or_default().convert() }
}

/// Names with one of the prefixes; none of ours has a dot, so the depth matters to nobody.
fn list(request: &ListParameters::Request) -> ListParameters::Response {
    let is_wanted = |name: &str| request.prefixes.is_empty() || request.prefixes.iter().any(|prefix| prefix == name);
    let names = PARAMETERS.iter().map(|declared| declared.name.to_owned()).filter(|name| is_wanted(name)).collect();
    ListParameters::Response { result: rcl::ListParametersResult { names, prefixes: Vec::new() } }
}

fn describe(name: &str) -> rcl::ParameterDescriptor {
    let mut described = rcl::ParameterDescriptor {
        name: name.to_owned(),
        type_: NOT_SET,
        description: String::new(),
        additional_constraints: String::new(),
        read_only: false,
        dynamic_typing: false,
        floating_point_range: Vec::new(),
        integer_range: Vec::new(),
    };
    let Ok(declared) = descriptor(name) else { return described };
    described.type_ = type_of(&declared.default_value());
    described.description = declared.description.to_owned();
    described.read_only = !declared.live;
    match declared.allowed {
        Allowed::Double(_, from_value, to_value) => {
            described.floating_point_range = vec![rcl::FloatingPointRange { from_value, to_value, step: 0.0 }];
        }
        Allowed::OneOf(_, words) => described.additional_constraints = format!("one of {}", words.join(", ")),
        Allowed::Bool(_) | Allowed::String(_) => {}
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

/// As it is on the wire; of `None` that it is not set.
fn raw(value: Option<&ParameterValue>) -> rcl::ParameterValue {
    let mut raw = rcl::ParameterValue {
        type_: value.map_or(NOT_SET, type_of),
        bool_value: false,
        integer_value: 0,
        double_value: 0.0,
        string_value: String::new(),
        byte_array_value: Vec::new(),
        bool_array_value: Vec::new(),
        integer_array_value: Vec::new(),
        double_array_value: Vec::new(),
        string_array_value: Vec::new(),
    };
    match value {
        Some(ParameterValue::Bool(on)) => raw.bool_value = *on,
        Some(ParameterValue::Integer(whole)) => raw.integer_value = *whole,
        Some(ParameterValue::Double(number)) => raw.double_value = *number,
        Some(ParameterValue::String(word)) => raw.string_value = word.clone().convert(),
        None => {}
    }
    raw
}

/// `None` of a type that no parameter here has.
fn ours(value: &rcl::ParameterValue) -> Option<ParameterValue> {
    match value.type_ {
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

    fn wanted(name: &str, value: rcl::ParameterValue) -> rcl::Parameter {
        rcl::Parameter { name: name.to_owned(), value }
    }

    #[test]
    fn a_value_comes_back_as_it_went() {
        let values = [
            ParameterValue::Bool(true),
            ParameterValue::Integer(-3),
            ParameterValue::Double(0.25),
            ParameterValue::String("hole".into()),
        ];
        for (value, type_) in values.into_iter().zip(1..) {
            let raw = raw(Some(&value));
            assert_eq!(raw.type_, type_, "as rcl_interfaces/msg/ParameterType counts them");
            assert_eq!(ours(&raw), Some(value));
        }
        assert_eq!((raw(None).type_, ours(&raw(None))), (0, None));
    }

    #[test]
    fn a_list_is_refused_and_so_is_what_the_table_refuses() {
        let values = Parameters::default();
        let list = rcl::ParameterValue { type_: 8, double_array_value: vec![1.0], ..raw(None) };
        let reason = check(&values, &wanted("view_rate_hz", list)).unwrap_err();
        assert_eq!(reason, "no parameter of this node has a value of this type");
        let high = raw(Some(&ParameterValue::Double(1e3)));
        let reason = check(&values, &wanted("view_rate_hz", high)).unwrap_err();
        assert_eq!(reason, "view_rate_hz is 1000.0: it may be 0.1 to 100");
        let whole = raw(Some(&ParameterValue::Integer(5)));
        assert_eq!(check(&values, &wanted("view_rate_hz", whole)), Ok(ParameterValue::Double(5.0)));
    }

    #[test]
    fn descriptions_tell_type_range_words_and_what_is_fixed() {
        let rate = describe("view_rate_hz");
        let range = &rate.floating_point_range[0];
        assert_eq!((rate.type_, rate.read_only, range.from_value, range.to_value), (3, false, 0.1, 100.0));
        let robot = describe("robot");
        assert_eq!((robot.type_, robot.read_only), (4, true));
        assert_eq!(robot.additional_constraints, "one of none, sim, ur");
        assert_eq!(describe("use_sim_time").type_, 1);
        assert_eq!((describe("nothing").type_, describe("nothing").name.as_str()), (0, "nothing"));
    }

    #[test]
    fn names_are_listed_all_or_those_that_are_asked_for() {
        let all = list(&ListParameters::Request { prefixes: Vec::new(), depth: 0 }).result.names;
        assert_eq!(all.len(), PARAMETERS.len());
        let request = ListParameters::Request { prefixes: vec!["robot".into(), "none".into()], depth: 1 };
        assert_eq!(list(&request).result.names, ["robot"]);
    }
}
