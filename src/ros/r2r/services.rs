//! The services of docs/ros.md.

use std::sync::Arc;

use r2r::qos::QosProfile;
use r2r::{Node, WrappedServiceTypeSupport};

use super::convert::Convert;
use super::touchup_msgs::srv::{DetectFeatures, FlagFeature, ProbeFeature, ResyncMesh, SaveMesh, Undo, UnflagFeature};
use super::{During, PollSource, R2rShared, RosError, source, std_srvs};
use crate::ros::port::{Arrival, Call, Reply};

/// All services but those of parameters and the action.
pub(super) fn servers(node: &mut Node, shared: &Arc<R2rShared>) -> Result<Vec<PollSource>, RosError> {
    let mut made = R2rServices { node, shared, sources: Vec::new() };
    made.add::<FlagFeature::Service, _>("~/flag_feature", |request, reply| Call::Flag(request.convert(), reply))?;
    made.add::<UnflagFeature::Service, _>("~/unflag_feature", |request, reply| Call::Unflag(request.convert(), reply))?;
    made.add::<DetectFeatures::Service, _>("~/detect_features", |request, reply| {
        Call::Detect(request.convert(), reply)
    })?;
    made.add::<SaveMesh::Service, _>("~/save_mesh", |request, reply| Call::Save(request.convert(), reply))?;
    made.add::<ResyncMesh::Service, _>("~/resync_mesh", |request, reply| Call::Resync(request.convert(), reply))?;
    made.add::<Undo::Service, _>("~/undo", |request, reply| Call::Undo(request.convert(), reply))?;
    made.add::<Undo::Service, _>("~/redo", |request, reply| Call::Redo(request.convert(), reply))?;
    made.add::<std_srvs::srv::Trigger::Service, _>("~/reset", |_, reply| Call::Reset(reply))?;
    made.add::<std_srvs::srv::Trigger::Service, _>("~/probe_all", |_, reply| Call::ProbeAll(reply))?;
    made.add::<std_srvs::srv::Trigger::Service, _>("~/recover", |_, reply| Call::Recover(reply))?;
    made.add::<std_srvs::srv::Trigger::Service, _>("~/arm_state", |_, reply| Call::ArmState(reply))?;
    made.add::<std_srvs::srv::SetBool::Service, _>("~/pause", |request, reply| Call::Pause(request.convert(), reply))?;
    made.add::<ProbeFeature::Service, _>("~/probe_feature", |request, reply| {
        Call::ProbeFeature(request.convert(), reply)
    })?;
    Ok(made.sources)
}

struct R2rServices<'a> {
    node: &'a mut Node,
    shared: &'a Arc<R2rShared>,
    sources: Vec<PollSource>,
}

impl R2rServices<'_> {
    fn add<T, A>(&mut self, name: &'static str, call: fn(T::Request, Reply<A>) -> Call) -> Result<(), RosError>
    where
        T: WrappedServiceTypeSupport + 'static,
        A: Convert<T::Response> + Send + 'static,
    {
        let shared = self.shared.clone();
        let take = move |request, reply| shared.arrivals.put(Arrival::Call(call(request, reply)));
        self.sources.push(server::<T, A>(self.node, name, self.shared, take)?);
        Ok(())
    }
}

/// A service whose requests go to `take`, with what answers them.
pub(super) fn server<T, A>(
    node: &mut Node,
    name: &'static str,
    shared: &Arc<R2rShared>,
    mut take: impl FnMut(T::Request, Reply<A>) + Send + 'static,
) -> Result<PollSource, RosError>
where
    T: WrappedServiceTypeSupport + 'static,
    A: Convert<T::Response> + Send + 'static,
{
    let requests = node.create_service::<T>(name, QosProfile::services_default()).during("offering a service")?;
    let shared = shared.clone();
    Ok(source(requests, move |request| {
        let message = request.message.clone();
        take(message, shared.reply(name, move |answer: A| request.respond(answer.convert())));
    }))
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    /// What stands between `before` and `after`, each time.
    fn between<'a>(text: &'a str, before: &'a str, after: char) -> BTreeSet<&'a str> {
        text.split(before).skip(1).filter_map(|rest| rest.split_once(after)).map(|(name, _)| name).collect()
    }

    #[test]
    fn the_services_are_those_of_the_documentation() {
        let text = std::fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/docs/ros.md")).unwrap();
        let (code, _) = include_str!("services.rs").split_once("#[cfg(test)]").unwrap();
        let mut here = between(code, "\"~/", '"');
        here.insert("probe");
        assert_eq!(super::super::action::NAME, "~/probe");
        assert_eq!(here, between(&text, "\n| `~/", '`'));
    }
}
