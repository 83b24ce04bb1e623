//! The memory that the program takes from the system.

/// Lets all threads share a few regions of free memory, as a program should that computes with all cores on the same
/// records.
///
/// The allocator of glibc gives each thread a region of its own, and what one thread frees no other one takes: a diagnosis of
/// five records holds 0.50 GB then, and 0.40 to 0.47 GB with two regions, in the same time (`cargo bench --bench long`). Other allocators are left as they are. To be
/// called before the first thread starts.
pub fn share() {
    #[cfg(all(target_os = "linux", target_env = "gnu"))]
    {
        const REGIONS: libc::c_int = 2;
        // SAFETY: it sets one number of the allocator
        unsafe { libc::mallopt(libc::M_ARENA_MAX, REGIONS) };
    }
}
