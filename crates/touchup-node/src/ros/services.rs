//! The services of docs/ros.md, except for parameters and the action.

use std::sync::Arc;

use crate::ros::exchange::RosError;
use crate::ros::inbox::Inbox;
use crate::ros::messages::*;
use crate::ros::port::{ArmOrder, Call, Reply};

/// A back end that offers services of one type.
pub(crate) trait Serves<S: RosService> {
    /// Has `call` answer requests.
    fn serve(
        &mut self,
        name: &'static str,
        call: impl FnMut(S::Request, Reply<S::Response>) + Send + 'static,
    ) -> Result<(), RosError>;
}

/// Services that share a state: name, type, and the state's answer for each.
macro_rules! services {
    ($(#[$doc:meta])* fn $serve:ident($State:ty); $($name:literal: $service:ident, $answer:expr;)+) => {
        $(#[$doc])*
        pub(crate) fn $serve<B>(back_end: &mut B, state: &Arc<$State>) -> Result<(), RosError>
        where
            $(B: Serves<$service>,)+
        {
            type Answer<S, Q, A> = fn(&Arc<S>, Q, Reply<A>);
            $({
                type Request = <$service as RosService>::Request;
                type Response = <$service as RosService>::Response;
                let (state, answer): (_, Answer<$State, Request, Response>) = (state.clone(), $answer);
                Serves::<$service>::serve(back_end, $name, move |request, reply| answer(&state, request, reply))?;
            })+
            Ok(())
        }
    };
}
pub(super) use services;

services! {
    /// Offers the services whose requests go to the inbox of the node, and those that stop its arm
    /// at once.
    fn serve(Inbox);
    "~/flag_feature": FlagFeature, |to, request, reply| to.call(Call::Flag(request, reply));
    "~/unflag_feature": UnflagFeature, |to, request, reply| to.call(Call::Unflag(request, reply));
    "~/detect_features": DetectFeatures, |to, request, reply| to.call(Call::Detect(request, reply));
    "~/save_mesh": SaveMesh, |to, request, reply| to.call(Call::Save(request, reply));
    "~/resync_mesh": ResyncMesh, |to, request, reply| to.call(Call::Resync(request, reply));
    "~/undo": Undo, |to, request, reply| to.call(Call::Undo(request, reply));
    "~/redo": Undo, |to, request, reply| to.call(Call::Redo(request, reply));
    "~/take_out_touch": TakeOutTouch, |to, request, reply| to.call(Call::TakeOut(request, reply));
    "~/reset": Trigger, |to, _, reply| to.call(Call::Reset(reply));
    "~/pause": SetBool, |to, request, reply| reply.send(to.stops().pause(request.data));
    "~/stop": Trigger, |to, _, reply| reply.send(to.stops().stop());
    "~/probe_all": Trigger, |to, _, reply| to.call(Call::Arm(ArmOrder::All(reply)));
    "~/recover": Trigger, |to, _, reply| to.call(Call::Arm(ArmOrder::Recover(reply)));
    "~/arm_state": Trigger, |to, _, reply| to.call(Call::ArmState(reply));
    "~/probe_feature": ProbeFeature, |to, request, reply| to.call(Call::Arm(ArmOrder::Feature(request, reply)));
}

/// Name of the action.
pub(super) const PROBE: &str = "~/probe";

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;
    use std::sync::mpsc::channel;

    use super::*;
    use crate::ros::inbox::inbox;
    use crate::ros::port::Arrival;
    use touchup_session::clock::Clock;

    /// Calls each stop service as soon as it is offered.
    struct CallsStops(Vec<String>);

    impl<S: RosService<Request: Default, Response: std::fmt::Debug>> Serves<S> for CallsStops {
        fn serve(
            &mut self,
            name: &'static str,
            mut call: impl FnMut(S::Request, Reply<S::Response>) + Send + 'static,
        ) -> Result<(), RosError> {
            if ["~/pause", "~/stop"].contains(&name) {
                let (to, answer) = channel();
                call(
                    S::Request::default(),
                    Reply::new(move |said| drop(to.send(said))),
                );
                self.0
                    .push(format!("{name}: {:?}", answer.try_recv().unwrap()));
            }
            Ok(())
        }
    }

    #[test]
    fn a_stop_is_answered_on_the_thread_that_hears_it_though_no_sample_finds_room() {
        let (inbox, _arrivals) = inbox(1, &Clock::system());
        while inbox.put(Arrival::Viewers(1)) {}
        let mut calls = CallsStops(Vec::new());
        serve(&mut calls, &Arc::new(inbox.clone())).unwrap();
        let CallsStops(answers) = calls;
        assert!(
            answers.len() == 2 && answers[0].contains("samples are taken"),
            "{answers:?}"
        );
        assert!(
            answers[1].contains("no arm configured") && inbox.stops().request().is_some(),
            "{answers:?}"
        );
    }

    /// Texts between `before` and `after`.
    fn between<'a>(text: &'a str, before: &'a str, after: char) -> BTreeSet<&'a str> {
        text.split(before)
            .skip(1)
            .filter_map(|rest| rest.split_once(after))
            .map(|(name, _)| name)
            .collect()
    }

    #[test]
    fn the_services_are_those_of_the_documentation() {
        let text =
            std::fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs/ros.md"))
                .unwrap();
        let (code, _) = include_str!("services.rs")
            .split_once("#[cfg(test)]")
            .unwrap();
        assert_eq!(between(code, "\"~/", '"'), between(&text, "\n| `~/", '`'));
    }
}
