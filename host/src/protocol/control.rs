//! What a user wants of a plotter while it draws.

/// A wish that is carried out while a job goes on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Control {
    /// Stop moving at once, wherever the pen is; nothing is lost, and [`Control::Resume`] goes on.
    Hold,
    /// Come to rest at the end of the stroke that is being drawn, with the pen up; [`Event::Paused`](super::Event::Paused)
    /// follows. Where the job has no such place ahead, the same as [`Control::Hold`].
    Pause,
    /// Go on after a hold, a pause or a prompt of the job.
    Resume,
    /// End the job: come to rest, lift the pen; [`Event::Failed`](super::Event::Failed) follows. Once is enough, and more does no harm.
    Stop,
    /// Draw at this speed, in percent of that of the job.
    Speed(u16),
    /// While the job rests with the pen up: move one of the pen's levels, for all that follows.
    PenHeight {
        /// The level with the pen down; else that with the pen up.
        down: bool,
        /// Steps away from the paper, or towards it where negative: fiftieths of a servo's way, or tenths of a millimetre.
        steps: i32,
    },
}
