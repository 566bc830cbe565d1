//! Memory for what thread mode computes: all of it can be taken back at once.
//!
//! Allocation is by two-level segregated fit (M. Masmano and others, TLSF, ECRTS 2004), in bounded time. Only thread mode may allocate, so no interrupt has to be held off meanwhile,
//! as an allocator behind a critical section would.
#![allow(unsafe_code, reason = "an allocator hands out memory")]

use core::alloc::{GlobalAlloc, Layout};
use core::cell::UnsafeCell;
use core::mem::MaybeUninit;
use core::ptr::{self, NonNull};
use core::sync::atomic::{AtomicUsize, Ordering::Relaxed};

use cortex_m::peripheral::SCB;
use cortex_m::peripheral::scb::VectActive;
use rlsf::Tlsf;

/// Classes of sizes: up to 2¹⁸ times 16 bytes, each halved five times.
type Blocks = Tlsf<'static, u32, u32, 18, 32>;

/// A heap of `SIZE` bytes, for the `#[global_allocator]` of a board. Empty until [`Heap::reset`].
pub(crate) struct Heap<const SIZE: usize> {
    blocks: UnsafeCell<Blocks>,
    memory: UnsafeCell<MaybeUninit<[u8; SIZE]>>,
    /// Bytes that are asked for now, that have been at most since the reset, and that were asked for in vain.
    used: AtomicUsize,
    peak: AtomicUsize,
    refused: AtomicUsize,
}

// SAFETY: `blocks` and `memory` are used by thread mode only, which `in_thread` makes sure of, and thread mode is one context.
unsafe impl<const SIZE: usize> Sync for Heap<SIZE> {}

impl<const SIZE: usize> Heap<SIZE> {
    pub(crate) const fn new() -> Self {
        Self {
            blocks: UnsafeCell::new(Blocks::new()),
            memory: UnsafeCell::new(MaybeUninit::uninit()),
            used: AtomicUsize::new(0),
            peak: AtomicUsize::new(0),
            refused: AtomicUsize::new(0),
        }
    }

    /// Takes everything back, and forgets the figures.
    ///
    /// # Safety
    /// In thread mode, and nothing that was allocated is used any more.
    pub(crate) unsafe fn reset(&self) {
        let memory = NonNull::slice_from_raw_parts(NonNull::from(&self.memory).cast(), SIZE);
        // SAFETY: nobody else is in here, by the caller's promise; the memory is this heap's own and never moves.
        unsafe {
            *self.blocks.get() = Blocks::new();
            (*self.blocks.get()).insert_free_block_ptr(memory);
        }
        for figure in [&self.used, &self.peak, &self.refused] {
            figure.store(0, Relaxed);
        }
    }

    /// Bytes in all.
    pub(crate) const fn size(&self) -> usize {
        SIZE
    }

    /// Bytes that were asked for and not given back yet. What the blocks take beside them is not counted.
    pub(crate) fn used(&self) -> usize {
        self.used.load(Relaxed)
    }

    /// The most that [`Heap::used`] has been since the reset.
    pub(crate) fn peak(&self) -> usize {
        self.peak.load(Relaxed)
    }

    /// Bytes that could not be had, the last time it happened since the reset.
    pub(crate) fn refused(&self) -> Option<usize> {
        Some(self.refused.load(Relaxed)).filter(|&bytes| bytes > 0)
    }

    fn took(&self, freed: usize, taken: usize) {
        let used = self.used().saturating_sub(freed).saturating_add(taken);
        self.used.store(used, Relaxed);
        self.peak.store(self.peak().max(used), Relaxed);
    }

    fn refuse(&self, layout: Layout) -> *mut u8 {
        self.refused.store(layout.size(), Relaxed);
        ptr::null_mut()
    }
}

fn in_thread() -> bool {
    SCB::vect_active() == VectActive::ThreadMode
}

// SAFETY: the blocks are those of a correct allocator; an interrupt, which could find it at work, is refused.
unsafe impl<const SIZE: usize> GlobalAlloc for Heap<SIZE> {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        if !in_thread() {
            return self.refuse(layout);
        }
        // SAFETY: in thread mode nobody else is in here.
        match unsafe { (*self.blocks.get()).allocate(layout) } {
            Some(block) => {
                self.took(0, layout.size());
                block.as_ptr()
            }
            None => self.refuse(layout),
        }
    }

    unsafe fn dealloc(&self, block: *mut u8, layout: Layout) {
        let Some(block) = NonNull::new(block).filter(|_| in_thread()) else { return };
        // SAFETY: in thread mode nobody else is in here, and the block is one of these by the caller's promise.
        unsafe { (*self.blocks.get()).deallocate(block, layout.align()) };
        self.took(layout.size(), 0);
    }

    unsafe fn realloc(&self, block: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        let Ok(wanted) = Layout::from_size_align(size, layout.align()) else { return ptr::null_mut() };
        let Some(block) = NonNull::new(block).filter(|_| in_thread()) else { return self.refuse(wanted) };
        // SAFETY: as above.
        match unsafe { (*self.blocks.get()).reallocate(block, wanted) } {
            Some(block) => {
                self.took(layout.size(), size);
                block.as_ptr()
            }
            None => self.refuse(wanted),
        }
    }
}
