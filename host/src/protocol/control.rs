//! What a user wants of a plotter while it draws.

/// A wish that is carried out while a job goes on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Control {
    /// Stop moving at once, wherever the pen is; nothing is lost, and [`Control::Resume`] goes on.
    Hold,
    /// Go on after a hold or a prompt of the job.
    Resume,
    /// End the job: come to rest, lift the pen; [`Event::Failed`](super::Event::Failed) follows. Once is enough, and more does no harm.
    Stop,
    /// Draw at this speed, in percent of that of the job.
    Speed(u16),
}
