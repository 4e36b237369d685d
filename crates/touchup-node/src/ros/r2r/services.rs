//! Services as servers of r2r.

use r2r::ServiceRequest;
use r2r::qos::QosProfile;

use super::back_end::{R2rBackEnd, RclErrorContext, source};
use super::convert::{Convert, R2rService};
use crate::ros::exchange::RosError;
use crate::ros::port::Reply;
use crate::ros::services::Serves;

impl<S: R2rService> Serves<S> for R2rBackEnd<'_> {
    fn serve(
        &mut self,
        name: &'static str,
        mut call: impl FnMut(S::Request, Reply<S::Response>) + Send + 'static,
    ) -> Result<(), RosError> {
        let requests = self
            .node
            .create_service::<S::Theirs>(name, QosProfile::services_default());
        let requests = requests.during("offering a service")?;
        let exchange = self.exchange.clone();
        self.sources.push(source(
            requests,
            move |request: ServiceRequest<S::Theirs>| {
                let asked = S::Request::ours(request.message.clone());
                call(
                    asked,
                    exchange.reply(name, move |answer: S::Response| {
                        request.respond(answer.theirs())
                    }),
                );
            },
        ));
        Ok(())
    }
}
