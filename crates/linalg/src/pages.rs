//! Large arrays on large pages of memory.

use std::alloc::{GlobalAlloc, Layout, System};

/// The system's allocator, which asks the kernel for pages of 2 MiB where an array of at least 4 MiB is to lie, in place of 4 KiB.
///
/// Each page is made at its first touch, one fault after the other; a problem with 10⁵ contacts touches a gigabyte. A program states
/// it as its `#[global_allocator]`; a library leaves that choice to the program. Where the kernel has no such pages, or on another system
/// than Linux, nothing changes. Cost: a system call for each array of 4 MiB; up to 2 MiB of memory at the end of one whose room is not used up.
#[derive(Debug, Clone, Copy, Default)]
pub struct LargePages;

/// A large page, in bytes.
const PAGE: usize = 2 << 20;

/// An array of so many bytes has a large page within it wherever it begins.
const WORTH: usize = 2 * PAGE;

/// Asks for large pages for those of them that lie within the array of `bytes` at `start`.
#[inline]
fn advise(start: *mut u8, bytes: usize) {
    if bytes >= WORTH && !start.is_null() {
        advise_large(start, bytes);
    }
}

#[cfg(target_os = "linux")]
#[cold]
fn advise_large(start: *mut u8, bytes: usize) {
    use nix::sys::mman::{MmapAdvise, madvise};

    let before = start.addr().next_multiple_of(PAGE) - start.addr();
    let within = (bytes - before) / PAGE * PAGE;
    // SAFETY: these bytes belong to the array, and the advice changes none of them.
    let advised = std::ptr::NonNull::new(start.wrapping_add(before).cast())
        .map(|first| unsafe { madvise(first, within, MmapAdvise::MADV_HUGEPAGE) });
    // A kernel without large pages refuses; its small ones do.
    let _ = advised;
}

#[cfg(not(target_os = "linux"))]
fn advise_large(_start: *mut u8, _bytes: usize) {}

// SAFETY: every request is passed on to the system's allocator unchanged; what it returns is only advised on.
unsafe impl GlobalAlloc for LargePages {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        // SAFETY: the caller's guarantees are those that `System` asks for; so below.
        let start = unsafe { System.alloc(layout) };
        advise(start, layout.size());
        start
    }

    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        // SAFETY: as above.
        let start = unsafe { System.alloc_zeroed(layout) };
        advise(start, layout.size());
        start
    }

    unsafe fn realloc(&self, old: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        // SAFETY: as above.
        let start = unsafe { System.realloc(old, layout, size) };
        advise(start, size);
        start
    }

    unsafe fn dealloc(&self, start: *mut u8, layout: Layout) {
        // SAFETY: as above.
        unsafe { System.dealloc(start, layout) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Arrays below and above the size that is worth it keep what they hold, grown and shrunk.
    #[test]
    fn arrays_keep_what_they_hold() {
        for bytes in [1, 4096, WORTH - 1, WORTH, WORTH + 1, 5 * WORTH + 12345] {
            let layout = Layout::from_size_align(bytes, 8).unwrap();
            let larger = 2 * bytes + 7;
            // SAFETY: the layouts are of sizes above 0, each array is freed once with the layout that it has, and read within it.
            unsafe {
                let zeroed = LargePages.alloc_zeroed(layout);
                assert!(!zeroed.is_null() && (0..bytes).all(|k| *zeroed.add(k) == 0));
                for k in 0..bytes {
                    *zeroed.add(k) = (k % 251) as u8;
                }
                let grown = LargePages.realloc(zeroed, layout, larger);
                assert!((0..bytes).all(|k| *grown.add(k) == (k % 251) as u8));
                grown.add(larger - 1).write(1);
                let layout = Layout::from_size_align(larger, 8).unwrap();
                let shrunk = LargePages.realloc(grown, layout, bytes);
                assert!((0..bytes).all(|k| *shrunk.add(k) == (k % 251) as u8));
                LargePages.dealloc(shrunk, Layout::from_size_align(bytes, 8).unwrap());
                let plain = LargePages.alloc(layout);
                plain.write_bytes(3, larger);
                assert_eq!(*plain.add(larger - 1), 3);
                LargePages.dealloc(plain, layout);
            }
        }
    }
}
