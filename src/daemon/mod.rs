//! The daemon: stays with a vehicle for months, and plans when its mission or fence changes.
//!
//! - here: signals, reloading, systemd, and looking for the vehicle on the configured links;
//! - [`session`]: one vehicle from being found to being lost;
//! - [`hints`]: signs of a change on the link; [`place`]: a vehicle that has moved; [`agenda`]: when
//!   to act on them;
//! - [`work`]: one look, plan and upload, which [`gate`] lets be called off until it writes; its
//!   [`answer`], and what is [`planned`] by then;
//! - [`requests`], [`own`], [`speech`]: quavd as a MAVLink component: commands, parameters, texts;
//! - [`status`], [`resources`], [`socket`], [`history`]: what a person on the board can see.
//!
//! One task looks after everything; only work, the link and the socket have tasks of their own.
//! systemd's watchdog is fed by that task, and only while its loop goes round.

mod agenda;
mod answer;
mod backoff;
mod gate;
mod hints;
mod history;
mod own;
mod place;
mod planned;
mod requests;
pub mod resources;
mod session;
pub(crate) mod socket;
mod speech;
pub mod status;
mod work;

use std::io;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

use sd_notify::NotifyState;
use tokio::signal::unix::{Signal, SignalKind, signal};
use tokio::sync::Notify;
use tokio::time::{Instant, timeout};
use tokio_util::sync::CancellationToken;

use self::answer::{Answer, Verdict};
use self::backoff::Backoff;
use self::history::History;
use self::own::Own;
use self::planned::{Basis, Planned};
use self::session::{Connection, Ended, stay};
use self::socket::Socket;
use self::status::Board;
use crate::cli::CliError;
use crate::config::Configuration;
use crate::link::{Endpoint, Link, Signer, Transport};
use crate::store::Store;
use crate::vehicle::find;

/// How often the supervising loop looks after itself.
const TICK: Duration = Duration::from_secs(1);
/// A loop that has not gone round for this long is stuck: the watchdog is not fed any more.
const STUCK: Duration = Duration::from_secs(10);
/// Threads for planning and the disk; more would only take memory.
const BLOCKING_THREADS: usize = 4;
/// What is left running when the daemon ends gets this long: a plan that was called off.
const LAST_THREADS: Duration = Duration::from_secs(1);

/// What outlives a connection.
struct Service {
    own: Own,
    store: Store,
    history: History,
    board: Board,
    pulse: Arc<Pulse>,
    trigger: Arc<Notify>,
    planned: Planned,
    /// A plan waits for the vehicle to be disarmed, which may be after a time out of reach.
    waits_for_disarming: bool,
    /// What the last answer was, so that the same trouble is told once.
    last: Option<Verdict>,
}

/// Proof that the loop that does the work goes round.
struct Pulse {
    began: Instant,
    beaten_ms: AtomicU64,
}

impl Pulse {
    fn new() -> Self {
        Self { began: Instant::now(), beaten_ms: AtomicU64::new(0) }
    }

    fn beat(&self) {
        let now = u64::try_from(self.began.elapsed().as_millis()).unwrap_or(u64::MAX);
        self.beaten_ms.store(now, Ordering::Relaxed);
    }

    fn is_alive(&self) -> bool {
        let beaten = Duration::from_millis(self.beaten_ms.load(Ordering::Relaxed));
        self.began.elapsed().saturating_sub(beaten) < STUCK
    }
}

/// Runs the daemon until it is told to end.
///
/// # Errors
/// [`CliError`] where it cannot begin: a configuration, a state directory or a socket that cannot
/// be used. A vehicle that is not there is no error, but waited for.
pub fn run(configuration: Configuration) -> Result<(), CliError> {
    let runtime = tokio::runtime::Builder::new_multi_thread()
        .worker_threads(2)
        .max_blocking_threads(BLOCKING_THREADS)
        .enable_all()
        .build()
        .map_err(|error| CliError::Usage(format!("cannot start: {error}")))?;
    let outcome = runtime.block_on(supervise(configuration));
    runtime.shutdown_timeout(LAST_THREADS);
    outcome
}

/// The signals that the daemon obeys.
struct Signals {
    terminate: Signal,
    interrupt: Signal,
    reload: Signal,
}

/// What a signal asks for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Order {
    End,
    Reload,
}

impl Signals {
    fn new() -> io::Result<Self> {
        Ok(Self {
            terminate: signal(SignalKind::terminate())?,
            interrupt: signal(SignalKind::interrupt())?,
            reload: signal(SignalKind::hangup())?,
        })
    }

    async fn next(&mut self) -> Order {
        tokio::select! {
            _ = self.terminate.recv() => Order::End,
            _ = self.interrupt.recv() => Order::End,
            _ = self.reload.recv() => Order::Reload,
        }
    }
}

async fn supervise(configuration: Configuration) -> Result<(), CliError> {
    let failed = |error: io::Error| CliError::Usage(format!("cannot listen to signals: {error}"));
    let mut signals = Signals::new().map_err(failed)?;
    let options = configuration.options()?;
    let state = options.vehicle.state_directory()?;
    let store = Store::open(&state)?;
    let path = socket::path(options.service.socket.as_deref(), &state);
    let socket = Socket::bind(&path).map_err(|error| {
        CliError::Usage(format!("cannot make the status socket {}: {error}", path.display()))
    })?;
    let own = Own::new(configuration.clone(), &state)?;
    let mut service = Service {
        history: History::new(&state, own.room_for_history()),
        own,
        store,
        board: Board::new(),
        pulse: Arc::new(Pulse::new()),
        trigger: Arc::new(Notify::new()),
        planned: Planned::default(),
        waits_for_disarming: false,
        last: None,
    };
    service.tell_options();
    tracing::info!(version = env!("CARGO_PKG_VERSION"), state = %state.display(), "quavd runs");
    notify(&[NotifyState::Ready]);

    let (board, trigger) = (service.board.clone(), Arc::clone(&service.trigger));
    let serving = socket.serve(&board, &trigger);
    tokio::pin!(serving);
    let mut configuration = configuration;
    loop {
        let halt = CancellationToken::new();
        let pulse = Arc::clone(&service.pulse);
        let order = {
            let connected = connections(&mut service, &halt);
            tokio::pin!(connected);
            let order = tokio::select! {
                // Neither of these ends unasked.
                () = &mut connected => Order::Reload,
                () = &mut serving => Order::End,
                order = fed(&pulse, feed, obey(&mut signals, &board, &mut configuration)) => order,
            };
            halt.cancel();
            let stopping = [NotifyState::Stopping];
            let reloading = [NotifyState::Reloading];
            notify(if order == Order::End { &stopping } else { &reloading });
            // An upload that goes on may take longer than systemd waits for a sign of life.
            fed(&pulse, feed, connected).await;
            order
        };
        if order == Order::End {
            tracing::info!("quavd ends");
            return Ok(());
        }
        match Own::new(configuration.clone(), &state) {
            Ok(own) => {
                service.history = History::new(&state, own.room_for_history());
                service.own = own;
                service.planned.forget();
                service.tell_options();
                tracing::info!("the configuration was read again");
            }
            Err(error) => tracing::error!(%error, "the configuration cannot be used"),
        }
        notify(&[NotifyState::Ready]);
    }
}

/// Waits for a signal that has to be acted on. A configuration that cannot be used is told and not
/// acted on.
async fn obey(signals: &mut Signals, board: &Board, configuration: &mut Configuration) -> Order {
    loop {
        let order = signals.next().await;
        if order == Order::End {
            return order;
        }
        match configuration.again() {
            Ok(read) => {
                *configuration = read;
                return order;
            }
            Err(error) => {
                tracing::error!(%error, "not read again: the old one stays");
                let trouble = format!("not read again: {error}");
                board.change(|status| status.trouble = Some(trouble));
            }
        }
    }
}

/// Waits for something, and feeds the watchdog meanwhile, as long as the loop that does the work
/// goes round.
async fn fed<T>(pulse: &Pulse, feed: impl Fn(), waiting: impl Future<Output = T>) -> T {
    tokio::pin!(waiting);
    let mut tick = tokio::time::interval(TICK);
    loop {
        tokio::select! {
            done = &mut waiting => return done,
            _ = tick.tick() => {
                if pulse.is_alive() {
                    feed();
                }
            }
        }
    }
}

fn feed() {
    notify(&[NotifyState::Watchdog]);
}

/// Tells systemd, where that started us.
fn notify(state: &[NotifyState<'_>]) {
    if let Err(error) = sd_notify::notify(state) {
        tracing::debug!(%error, "systemd was not told");
    }
}

/// Looks for the vehicle on one link after the other, and stays with it where it is found. Ends
/// when halted.
async fn connections(service: &mut Service, halt: &CancellationToken) {
    let longest = Duration::from_secs(service.own.options.service.retry.into());
    let mut backoff = Backoff::new(longest);
    let mut told = String::new();
    loop {
        for endpoint in service.own.options.connect.clone() {
            service.board.change(|status| {
                status.state = "connecting".to_owned();
                status.endpoint = Some(endpoint.to_string());
                status.vehicle = None;
                status.progress = None;
            });
            let connecting = service.pulse.beating(connect(service, &endpoint));
            let connected = tokio::select! {
                () = halt.cancelled() => return,
                connected = connecting => connected,
            };
            match connected {
                Ok(connection) => {
                    backoff.reset();
                    told.clear();
                    service.board.change(|status| {
                        status.counts.connections += 1;
                        status.trouble = None;
                    });
                    let ended = stay(service, connection, halt).await;
                    if matches!(ended, Ended::Halted) {
                        return;
                    }
                    tracing::warn!(%endpoint, %ended, "the vehicle is lost; looking for it again");
                    service.board.change(|status| status.trouble = Some(ended.to_string()));
                }
                Err(error) => {
                    let error = error.to_string();
                    service.board.change(|status| status.trouble = Some(error.clone()));
                    // The same trouble each minute of a night is one line of the journal.
                    if told == error {
                        tracing::debug!(%endpoint, %error, "no vehicle");
                    } else {
                        tracing::warn!(%endpoint, %error, "no vehicle");
                        told = error;
                    }
                }
            }
        }
        let pause = service.pulse.beating(tokio::time::sleep(backoff.pause()));
        tokio::select! {
            () = halt.cancelled() => return,
            () = pause => {}
        }
    }
}

/// Opens a link and finds the vehicle on it.
async fn connect(service: &Service, endpoint: &Endpoint) -> Result<Connection, CliError> {
    let options = &service.own.options;
    let search = options.vehicle.search();
    let opening = timeout(search.patience, Transport::open(endpoint));
    let mut transport = opening.await.map_err(|_| {
        let waited = search.patience.as_secs();
        CliError::Unreachable(format!("nobody connected to {endpoint} within {waited} s"))
    })??;
    if let Some(settings) = options.signing.settings() {
        let state = options.vehicle.state_directory()?;
        transport = transport.signed(Signer::open(&settings, &state)?);
    }
    let identity = options.vehicle.identity();
    let (link, task) = Link::start(transport, identity, CancellationToken::new());
    let found = async {
        let inbox = link.subscribe()?;
        let vehicle = find(&link, &search).await?;
        Ok::<_, CliError>((inbox, vehicle))
    };
    match found.await {
        Ok((inbox, vehicle)) => Ok(Connection { link, task, inbox, vehicle: Arc::new(vehicle) }),
        Err(error) => {
            drop(link);
            task.close().await;
            Err(error)
        }
    }
}

impl Pulse {
    /// Waits for something whose time is bounded, and beats meanwhile.
    async fn beating<T>(&self, waiting: impl Future<Output = T>) -> T {
        tokio::pin!(waiting);
        let mut tick = tokio::time::interval(TICK);
        loop {
            tokio::select! {
                done = &mut waiting => return done,
                _ = tick.tick() => self.beat(),
            }
        }
    }
}

impl Service {
    /// Keeps what an answer says about what is planned. Where it is to be tried again, nothing is.
    fn keep(&mut self, answer: &Answer, basis: Basis) {
        if !answer.verdict.is_worth_retrying() {
            // What was just written is a change as well: the next look sees that it is ours.
            self.planned.keep(basis, answer.fingerprint, answer.planned_from);
        }
        self.waits_for_disarming = answer.verdict == Verdict::Armed;
    }

    /// Shows the options in force.
    fn tell_options(&self) {
        let service = &self.own.options.service;
        self.board.change(|status| {
            status.enabled = service.enable;
            status.policy = service.policy.name().to_owned();
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[tokio::test(start_paused = true)]
    async fn the_watchdog_is_fed_only_while_the_loop_goes_round() {
        const MINUTE: Duration = Duration::from_secs(60);
        let pulse = Pulse::new();
        let meals = AtomicU64::new(0);
        let feed = || {
            meals.fetch_add(1, Ordering::Relaxed);
        };
        fed(&pulse, feed, pulse.beating(tokio::time::sleep(MINUTE))).await;
        let while_it_went = meals.swap(0, Ordering::Relaxed);
        assert!(while_it_went >= 59, "{while_it_went}");
        fed(&pulse, feed, tokio::time::sleep(MINUTE)).await;
        let while_it_was_stuck = meals.load(Ordering::Relaxed);
        assert!(while_it_was_stuck <= STUCK.as_secs() + 1, "{while_it_was_stuck}");
    }
}
