//! How Python calls the library: without the interpreter's lock, with progress, and so that Ctrl-C is heard.
//!
//! The work runs on a thread of its own with a pool of its own. A pool that is shared between calls would not outlive a
//! `fork`, and a call that waits for a part of its work could be handed the work of another. The thread of the caller
//! waits, hands progress on and looks for signals.

use crate::error::{internal, to_python};
use pyo3::prelude::*;
use rayon::{ThreadPool, ThreadPoolBuilder};
use std::any::Any;
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::sync::atomic::{AtomicBool, AtomicPtr, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::sync::{Arc, Mutex};
use std::time::Duration;

/// Time between two looks for signals.
const LOOK: Duration = Duration::from_millis(30);
/// Stack of the threads; that of a program's main thread is as large.
const STACK: usize = 8 << 20;

/// A word on where a call stands.
pub struct Note {
    /// how much is done, of how much; both 0 where that is not known
    pub done: f64,
    pub of: f64,
    /// in words
    pub text: String,
}

enum Message<T> {
    Note(Note),
    Done(Result<T, Failure>),
}

enum Failure {
    Error(excite::Error),
    Cancelled,
    Panic(String),
}

/// What is thrown through the work to end it.
struct Cancelled;

/// The side of the work.
pub struct Reporter {
    notes: Box<dyn Fn(Note) + Send + Sync>,
    cancel: Arc<AtomicBool>,
}

impl Reporter {
    /// Tells where the work stands; ends it here where it is cancelled.
    pub fn tell(&self, done: f64, of: f64, text: impl Into<String>) {
        if self.cancel.load(Ordering::Relaxed) {
            resume_unwind(Box::new(Cancelled));
        }
        self.note(done, of, text);
    }

    /// Tells where the work stands, which ends by the flag.
    pub fn note(&self, done: f64, of: f64, text: impl Into<String>) {
        let text = text.into();
        (self.notes)(Note { done, of, text });
    }

    /// Set when the work is to end.
    pub fn flag(&self) -> &AtomicBool {
        &self.cancel
    }
}

/// What an interrupted call does.
#[derive(Clone, Copy, PartialEq)]
pub enum Interrupted {
    /// leaves the work, which ends by itself
    Leaves,
    /// waits for what the work has so far
    Waits,
}

/// Does the work of a call. Gives its result and, where a signal ended it early and the call waits for what there is,
/// the exception of that signal.
pub fn call<T: Send + 'static>(
    py: Python<'_>,
    progress: Option<&Bound<'_, PyAny>>,
    interrupted: Interrupted,
    work: impl FnOnce(&Reporter) -> excite::Result<T> + Send + 'static,
) -> PyResult<(T, Option<PyErr>)> {
    let cancel = Arc::new(AtomicBool::new(false));
    let (sender, receiver) = channel();
    start(sender, cancel.clone(), work).map_err(|e| internal(&e.to_string()))?;
    let receiver = Mutex::new(receiver);
    let mut signal: Option<PyErr> = None;
    loop {
        let message = py.detach(|| next(&receiver));
        // a signal that comes while there is a result is the interpreter's
        match message {
            Some(Message::Done(Ok(value))) => return Ok((value, signal)),
            Some(Message::Done(Err(failure))) => {
                let error = match failure {
                    Failure::Error(e) => to_python(&e),
                    Failure::Panic(text) => internal(&text),
                    Failure::Cancelled => internal("cancelled"),
                };
                return Err(signal.unwrap_or(error));
            }
            Some(Message::Note(note)) => {
                if let (Some(f), None) = (progress, &signal)
                    && let Err(e) = f.call1((note.done, note.of, note.text))
                {
                    cancel.store(true, Ordering::Relaxed);
                    return Err(e);
                }
            }
            None => {}
        }
        if let Err(e) = py.check_signals() {
            cancel.store(true, Ordering::Relaxed);
            // the second one does not wait
            if interrupted == Interrupted::Leaves || signal.is_some() {
                return Err(e);
            }
            signal = Some(e);
        }
    }
}

/// [`call`] for what is left at once when a signal comes.
pub fn simply<T: Send + 'static>(
    py: Python<'_>,
    work: impl FnOnce(&Reporter) -> excite::Result<T> + Send + 'static,
) -> PyResult<T> {
    Ok(call(py, None, Interrupted::Leaves, work)?.0)
}

/// The next message; `None` where there is none for a while.
fn next<T>(receiver: &Mutex<Receiver<Message<T>>>) -> Option<Message<T>> {
    let receiver = match receiver.lock() {
        Ok(r) => r,
        Err(poisoned) => poisoned.into_inner(),
    };
    match receiver.recv_timeout(LOOK) {
        Ok(message) => Some(message),
        Err(RecvTimeoutError::Timeout) => None,
        Err(RecvTimeoutError::Disconnected) => Some(Message::Done(Err(Failure::Panic(
            "the thread of the work has gone".into(),
        )))),
    }
}

/// Starts the thread of the work.
fn start<T: Send + 'static>(
    sender: Sender<Message<T>>,
    cancel: Arc<AtomicBool>,
    work: impl FnOnce(&Reporter) -> excite::Result<T> + Send + 'static,
) -> std::io::Result<()> {
    let notes = sender.clone();
    // who waits may have left
    let reporter = Reporter {
        notes: Box::new(move |n| drop(notes.send(Message::Note(n)))),
        cancel,
    };
    std::thread::Builder::new()
        .name("excite".into())
        .stack_size(STACK)
        .spawn(move || {
            let done = catch_unwind(AssertUnwindSafe(|| {
                let pool = pool()?;
                pool.install(|| work(&reporter))
            }));
            let result = match done {
                Ok(Ok(value)) => Ok(value),
                Ok(Err(e)) => Err(Failure::Error(e)),
                Err(thrown) if thrown.is::<Cancelled>() => Err(Failure::Cancelled),
                Err(thrown) => Err(Failure::Panic(words(thrown.as_ref()))),
            };
            let _ = sender.send(Message::Done(result));
        })?;
    Ok(())
}

/// The words of a panic.
fn words(thrown: &(dyn Any + Send)) -> String {
    let text = thrown.downcast_ref::<&str>().map(|s| s.to_string());
    let text = text.or_else(|| thrown.downcast_ref::<String>().cloned());
    text.unwrap_or_else(|| "no words".into())
}

fn pool() -> excite::Result<ThreadPool> {
    ThreadPoolBuilder::new()
        .stack_size(STACK)
        .thread_name(|k| format!("excite-{k}"))
        .build()
        .map_err(|e| excite::Error::Argument(format!("threads: {e}")))
}

/// A pool and the process that it belongs to.
type Own = (u32, ThreadPool);

static SHARED: AtomicPtr<Own> = AtomicPtr::new(std::ptr::null_mut());

/// The pool for work that is done in one piece and soon; one of its own in a process that was forked.
fn shared() -> excite::Result<&'static ThreadPool> {
    let process = std::process::id();
    let old = SHARED.load(Ordering::Acquire);
    // SAFETY: what is stored came from `Box::into_raw` and is never freed: its threads may live in another process
    if let Some((owner, pool)) = unsafe { old.as_ref() }
        && *owner == process
    {
        return Ok(pool);
    }
    let fresh = Box::into_raw(Box::new((process, pool()?)));
    let now = match SHARED.compare_exchange(old, fresh, Ordering::AcqRel, Ordering::Acquire) {
        Ok(_) => fresh,
        // another thread of this process was first; its pool serves as well
        Err(other) => other,
    };
    // SAFETY: as above, and not null
    Ok(unsafe { &(*now).1 })
}

/// Short work without the interpreter's lock.
pub fn quick<T: Send>(
    py: Python<'_>,
    work: impl FnOnce() -> excite::Result<T> + Send,
) -> PyResult<T> {
    let done = py.detach(|| {
        catch_unwind(AssertUnwindSafe(|| {
            let pool = shared()?;
            pool.install(work)
        }))
    });
    match done {
        Ok(Ok(value)) => Ok(value),
        Ok(Err(e)) => Err(to_python(&e)),
        Err(thrown) => Err(internal(&words(thrown.as_ref()))),
    }
}
