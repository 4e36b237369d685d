//! The six services of parameters, as `ros2 param` calls them.
//!
//! Own ones, since those of ros2-client know one mapping of services alone, and neither ranges nor descriptions.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use ros2_client::parameters::raw;
use ros2_client::rcl_interfaces::{
    DescribeParametersRequest, DescribeParametersResponse, GetParameterTypesRequest, GetParameterTypesResponse,
    GetParametersRequest, GetParametersResponse, ListParametersRequest, ListParametersResponse, ListParametersResult,
    SetParametersAtomicallyResponse, SetParametersRequest, SetParametersResponse,
};
use ros2_client::{Context, Node, NodeOptions};

use super::answers::Shrinkable;
use super::incoming::Listener;
use super::server::Server;
use super::services::Service;
use super::{DdsShared, RosError};
use crate::ros::arguments::NodeConfig;
use crate::ros::parameters::{Allowed, PARAMETERS, ParameterDescriptor, ParameterValue, Parameters, descriptor};
use crate::ros::port::{Arrival, Reply};

/// Parameters that one call may name; those after them are passed over.
const MOST_NAMES: usize = 1024;

/// Tells ros2-client the values, so that it announces their changes on `/parameter_events`.
pub(super) fn declare(options: NodeOptions, parameters: &Parameters) -> NodeOptions {
    PARAMETERS.iter().fold(options, |options, declared| {
        let value = parameters.value(declared.name).cloned().unwrap_or(declared.default_value());
        options.declare_parameter(declared.name, native(value))
    })
}

/// The servers, not yet at work.
pub(super) struct ParameterServers {
    shared: Arc<DdsShared>,
    values: Parameters,
    get: Arc<Server<GetParametersRequest, GetParametersResponse>>,
    get_types: Arc<Server<GetParameterTypesRequest, GetParameterTypesResponse>>,
    list: Arc<Server<ListParametersRequest, ListParametersResponse>>,
    describe: Arc<Server<DescribeParametersRequest, DescribeParametersResponse>>,
    set: Arc<Server<SetParametersRequest, SetParametersResponse>>,
    set_atomically: Arc<Server<SetParametersRequest, SetParametersAtomicallyResponse>>,
}

/// Makes the servers.
pub(super) fn servers(
    config: &NodeConfig,
    context: &Context,
    node: &mut Node,
    shared: &Arc<DdsShared>,
) -> Result<ParameterServers, RosError> {
    let package = "rcl_interfaces";
    Ok(ParameterServers {
        shared: shared.clone(),
        values: config.parameters.clone(),
        get: Arc::new(Server::new(config, context, node, "~/get_parameters", package, "GetParameters")?),
        get_types: Arc::new(Server::new(config, context, node, "~/get_parameter_types", package, "GetParameterTypes")?),
        list: Arc::new(Server::new(config, context, node, "~/list_parameters", package, "ListParameters")?),
        describe: Arc::new(Server::new(config, context, node, "~/describe_parameters", package, "DescribeParameters")?),
        set: Arc::new(Server::new(config, context, node, "~/set_parameters", package, "SetParameters")?),
        set_atomically: Arc::new(Server::new(
            config,
            context,
            node,
            "~/set_parameters_atomically",
            package,
            "SetParametersAtomically",
        )?),
    })
}

impl ParameterServers {
    /// Sets them to work.
    pub fn listeners(self, node: &Arc<Node>) -> Vec<Box<dyn Listener>> {
        let shared = self.shared;
        let held =
            Arc::new(DdsParameters { shared: shared.clone(), node: node.clone(), values: Mutex::new(self.values) });
        let [for_get, for_types, for_set, for_all] = std::array::from_fn(|_| held.clone());
        let get = move |request: GetParametersRequest| {
            let values = few(&request.names).iter().map(|name| for_get.raw(name)).collect();
            GetParametersResponse { values }
        };
        let types = move |request: GetParameterTypesRequest| {
            let values = few(&request.names).iter().map(|name| for_types.raw(name).ptype).collect();
            GetParameterTypesResponse { values }
        };
        let describe = |request: DescribeParametersRequest| {
            let values = few(&request.names).iter().map(|name| describe(name)).collect();
            DescribeParametersResponse { values }
        };
        let set = move |request: SetParametersRequest, reply: Reply<SetParametersResponse>| {
            let reply = move |results: Vec<_>| {
                reply.send(SetParametersResponse { results: results.into_iter().map(result).collect() });
            };
            for_set.set(request.parameter, Box::new(reply));
        };
        let set_all = move |request: SetParametersRequest, reply: Reply<SetParametersAtomicallyResponse>| {
            for_all.set_all(request.parameter, reply);
        };
        vec![
            answered("~/get_parameters", &shared, self.get, get),
            answered("~/get_parameter_types", &shared, self.get_types, types),
            answered("~/list_parameters", &shared, self.list, |request| list(&request)),
            answered("~/describe_parameters", &shared, self.describe, describe),
            Box::new(Service {
                name: "~/set_parameters",
                server: self.set,
                shared: shared.clone(),
                call: Box::new(set),
            }),
            Box::new(Service {
                name: "~/set_parameters_atomically",
                server: self.set_atomically,
                shared,
                call: Box::new(set_all),
            }),
        ]
    }
}

/// A service that needs nobody to answer.
fn answered<Q, A>(
    name: &'static str,
    shared: &Arc<DdsShared>,
    server: Arc<Server<Q, A>>,
    mut answer: impl FnMut(Q) -> A + Send + 'static,
) -> Box<dyn Listener>
where
    Q: ros2_client::Message + Send + Sync + 'static,
    A: Shrinkable + Send + Sync + 'static,
{
    let call = Box::new(move |request, reply: Reply<A>| reply.send(answer(request)));
    Box::new(Service { name, server, shared: shared.clone(), call })
}

/// The values as others see them.
struct DdsParameters {
    shared: Arc<DdsShared>,
    node: Arc<Node>,
    values: Mutex<Parameters>,
}

type Results = Vec<Result<(), String>>;

impl DdsParameters {
    fn values(&self) -> MutexGuard<'_, Parameters> {
        // no code of ours panics while it holds it
        self.values.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn raw(&self, name: &str) -> raw::ParameterValue {
        raw_value(&self.values(), name)
    }

    /// Asks the node for one after the other, and answers when all are done.
    fn set(self: &Arc<Self>, parameters: Vec<raw::Parameter>, answer: Box<dyn FnOnce(Results) + Send>) {
        let wanted = parameters.into_iter().take(MOST_NAMES).collect::<Vec<_>>().into_iter();
        self.clone().set_next(wanted, Vec::new(), answer);
    }

    fn set_next(
        self: Arc<Self>,
        mut wanted: std::vec::IntoIter<raw::Parameter>,
        mut results: Results,
        answer: Box<dyn FnOnce(Results) + Send>,
    ) {
        // what is refused here needs no answer of the node
        let (name, value) = loop {
            let Some(next) = wanted.next() else { return answer(results) };
            match self.check(&next) {
                Ok(value) => break (next.name, value),
                Err(reason) => results.push(Err(reason)),
            }
        };
        let shared = self.shared.clone();
        let (set_name, set_value) = (name.clone(), value.clone());
        let reply = Reply::new(move |result: Result<(), String>| {
            if result.is_ok() {
                self.keep(&set_name, set_value);
            }
            results.push(result);
            self.set_next(wanted, results, answer);
        });
        shared.arrivals.put(Arrival::SetParameter(name, value, reply));
    }

    /// All or none, as far as the table of parameters can tell before any is set.
    fn set_all(self: &Arc<Self>, parameters: Vec<raw::Parameter>, reply: Reply<SetParametersAtomicallyResponse>) {
        let refused = parameters.iter().find_map(|parameter| self.check(parameter).err());
        if let Some(reason) = refused {
            return reply.send(SetParametersAtomicallyResponse { result: result(Err(reason)) });
        }
        let answer = move |results: Results| {
            let first = results.into_iter().find(Result::is_err).unwrap_or(Ok(()));
            reply.send(SetParametersAtomicallyResponse { result: result(first) });
        };
        self.set(parameters, Box::new(answer));
    }

    fn check(&self, parameter: &raw::Parameter) -> Result<ParameterValue, String> {
        let value = ours(parameter.value.clone()).ok_or("it has a type that no parameter of this node has")?;
        let mut values = self.values().clone();
        values.set_live(&parameter.name, &value).map_err(|error| error.to_string())?;
        values.value(&parameter.name).cloned().ok_or_else(|| "it is not there".to_owned())
    }

    fn keep(&self, name: &str, value: ParameterValue) {
        // it was checked before the node was asked
        let _ = self.values().set_live(name, &value);
        if let Err(reason) = self.node.set_parameter(name, native(value)) {
            tracing::warn!(name, reason, "a change of a parameter is not announced");
        }
    }
}

fn raw_value(values: &Parameters, name: &str) -> raw::ParameterValue {
    values.value(name).cloned().map_or(ros2_client::ParameterValue::NotSet, native).into()
}

fn few(names: &[String]) -> &[String] {
    &names[..names.len().min(MOST_NAMES)]
}

fn result(result: Result<(), String>) -> raw::SetParametersResult {
    raw::SetParametersResult { successful: result.is_ok(), reason: result.err().unwrap_or_default() }
}

/// Names with one of the prefixes; none of ours has a dot, so the depth matters to nobody.
fn list(request: &ListParametersRequest) -> ListParametersResponse {
    let is_wanted = |name: &str| request.prefixes.is_empty() || request.prefixes.iter().any(|prefix| prefix == name);
    let names = PARAMETERS.iter().map(|declared| declared.name.to_owned()).filter(|name| is_wanted(name)).collect();
    ListParametersResponse { result: ListParametersResult { names, prefixes: Vec::new() } }
}

fn describe(name: &str) -> raw::ParameterDescriptor {
    let mut described = raw::ParameterDescriptor {
        name: name.to_owned(),
        r#type: raw::ParameterType::NOT_SET,
        description: String::new(),
        additional_constraints: String::new(),
        read_only: false,
        dynamic_typing: false,
        floating_point_range: Vec::new(),
        integer_range: Vec::new(),
    };
    let Ok(ParameterDescriptor { allowed, live, description, .. }) = descriptor(name) else { return described };
    described.description = (*description).to_owned();
    described.read_only = !live;
    described.r#type = match allowed {
        Allowed::Bool(_) => raw::ParameterType::BOOL,
        Allowed::Double(..) => raw::ParameterType::DOUBLE,
        Allowed::String(_) | Allowed::OneOf(..) => raw::ParameterType::STRING,
    };
    match *allowed {
        Allowed::Double(_, from_value, to_value) => {
            described.floating_point_range = vec![raw::FloatingPointRange { from_value, to_value, step: 0.0 }];
        }
        Allowed::OneOf(_, words) => described.additional_constraints = format!("one of {}", words.join(", ")),
        Allowed::Bool(_) | Allowed::String(_) => {}
    }
    described
}

fn native(value: ParameterValue) -> ros2_client::ParameterValue {
    match value {
        ParameterValue::Bool(on) => ros2_client::ParameterValue::Boolean(on),
        ParameterValue::Integer(whole) => ros2_client::ParameterValue::Integer(whole),
        ParameterValue::Double(number) => ros2_client::ParameterValue::Double(number),
        ParameterValue::String(word) => ros2_client::ParameterValue::String(word),
    }
}

fn ours(value: raw::ParameterValue) -> Option<ParameterValue> {
    match value.into() {
        ros2_client::ParameterValue::Boolean(on) => Some(ParameterValue::Bool(on)),
        ros2_client::ParameterValue::Integer(whole) => Some(ParameterValue::Integer(whole)),
        ros2_client::ParameterValue::Double(number) => Some(ParameterValue::Double(number)),
        ros2_client::ParameterValue::String(word) => Some(ParameterValue::String(word)),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::super::answers::{ETHERNET, Shrinkable, room, size};
    use super::*;

    fn names() -> Vec<String> {
        PARAMETERS.iter().map(|declared| declared.name.to_owned()).collect()
    }

    /// What `ros2 param dump` asks for.
    fn all_values(values: &Parameters) -> GetParametersResponse {
        GetParametersResponse { values: names().iter().map(|name| raw_value(values, name)).collect() }
    }

    fn described() -> DescribeParametersResponse {
        DescribeParametersResponse { values: names().iter().map(|name| describe(name)).collect() }
    }

    /// As a launch file starts it: paths where there are some.
    fn launched() -> Parameters {
        let mut values = Parameters::default();
        let share = "/home/somebody/ws/install/touchup/share/touchup/config/probe.yaml";
        for (name, path) in [("scene", share), ("scan", "/home/somebody/scans/part.ply"), ("tool_frame", "probe_tip")] {
            values.set(name, &ParameterValue::String(path.to_owned())).unwrap();
        }
        values
    }

    #[test]
    fn what_is_asked_of_all_parameters_fits_into_one_packet() {
        let mut described_briefly = described();
        described_briefly.reduce(room(ETHERNET));
        let types = GetParameterTypesResponse { values: vec![0; PARAMETERS.len()] };
        let live = PARAMETERS.iter().filter(|declared| declared.live);
        let refused =
            |one: &ParameterDescriptor| Parameters::default().set_live(one.name, &ParameterValue::Integer(-1));
        let results = live.map(|one| result(refused(one).map_err(|why| why.to_string()))).collect();
        let sizes = [
            ("list_parameters", size(&list(&ListParametersRequest { prefixes: Vec::new(), depth: 0 }))),
            ("get_parameters of all, as they are declared", size(&all_values(&Parameters::default()))),
            ("get_parameters of all, with paths", size(&all_values(&launched()))),
            ("get_parameter_types of all", size(&types)),
            ("describe_parameters of all, without descriptions", size(&described_briefly)),
            ("set_parameters of all that are live, refused", size(&SetParametersResponse { results })),
        ];
        println!("{} parameters; described in full: {} bytes", PARAMETERS.len(), size(&described()));
        for (service, bytes) in sizes {
            println!("{bytes:5} bytes of {} {service}", room(ETHERNET));
            assert!(bytes <= room(ETHERNET), "{service}: {bytes} bytes");
        }
        // nothing but the descriptions is left out
        let of = |one: &raw::ParameterDescriptor| (one.name.clone(), one.r#type, one.additional_constraints.clone());
        assert_eq!(
            described_briefly.values.iter().map(of).collect::<Vec<_>>(),
            described().values.iter().map(of).collect::<Vec<_>>()
        );
        assert!(described_briefly.values.iter().all(|one| one.description.is_empty()));
    }

    #[test]
    fn a_few_parameters_are_described_in_full() {
        let described = |few: &[String]| few.iter().map(|name| describe(name)).collect();
        let names = names();
        let largest = names.windows(8).map(|few| size(&DescribeParametersResponse { values: described(few) }));
        let largest = largest.max().unwrap();
        println!("{largest} bytes of {}", room(ETHERNET));
        assert!(largest <= room(ETHERNET));
    }
}
