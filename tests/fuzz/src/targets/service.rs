//! What IBM's service answers.

use std::cell::RefCell;
use std::collections::VecDeque;
use std::sync::{Arc, Mutex};
use std::time::Duration;

use quav::ibm::account::{Credentials, Endpoints};
use quav::ibm::client::backends::BackendChoice;
use quav::ibm::client::jobs::Submission;
use quav::ibm::client::{Client, Patience};
use quav::ibm::program::{Program, Pub, Sampler};
use quav::ibm::secret::Secret;
use quav::ibm::{Device, PhysicalQubit};
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::{TcpListener, TcpStream};

/// What IBM's service says about a backend: its two documents with a zero byte between them.
pub(super) fn device(data: &[u8]) {
    let Ok(text) = std::str::from_utf8(data) else { return };
    let (configuration, properties) = text.split_once('\0').unwrap_or((text, text));
    let Ok(device) = Device::parse(configuration, properties) else { return };
    for index in 0..device.qubits().len() {
        let qubit = device.qubit(PhysicalQubit(index as u32)).expect("it is in the list");
        let _ = qubit.usable();
    }
}

/// The results of a job of three circuits; the first byte says how many shots they had.
pub(super) fn results(data: &[u8]) {
    let Some((&shots, body)) = data.split_first() else { return };
    let shots = u32::from(shots % 8);
    let circuit = |bits| Pub { qasm: String::new(), values: Vec::new(), bits };
    let pubs = [circuit(1), circuit(3), circuit(70)];
    for asked in [&pubs[..1], &pubs] {
        let Ok(measured) = Sampler.decode(body, asked, shots) else { continue };
        assert_eq!(measured.len(), asked.len());
        for (samples, circuit) in measured.iter().zip(asked) {
            assert_eq!(samples.iter().map(|sample| sample.count).sum::<u32>(), shots);
            assert!(samples.iter().all(|sample| sample.bits.len() == circuit.bits));
        }
    }
}

/// One call of the client, and a service that answers with anything: the first byte chooses the
/// call, then come the answers, each with a byte for its status, two for its length, and its body.
/// The first one is for whoever asks for a token.
pub(super) fn service(data: &[u8]) {
    let Some((&call, answers)) = data.split_first() else { return };
    SERVICE.with_borrow(|Service { runtime, client, answers: to_give }| {
        let mut others = answers_in(answers);
        let token = others.pop_front().unwrap_or_default();
        *to_give.lock().expect("nobody panicked") = Answers { token, others, is_refused: true };
        runtime.block_on(async {
            match call % 9 {
                0 => drop(client.usage().await.map(|usage| usage.left())),
                1 => drop(client.choose(&BackendChoice::LeastBusy, 3).await),
                2 => drop(client.device("ibm_small").await),
                3 => drop(client.open_batch("ibm_small", 60).await),
                4 => drop(client.job_state("job").await),
                5 => drop(client.results("job", 1 << 10, |_| {}).await),
                6 => drop(client.metrics("job").await.map(|cost| cost.qpu_seconds())),
                7 => drop(client.cancel("job").await),
                _ => {
                    let params = serde_json::Value::Null;
                    let (backend, tag) = ("ibm_small", "quavd-1");
                    let submission =
                        Submission { backend, params: &params, tag, cost: 1, session: None };
                    drop(client.submit(&Sampler, &submission).await);
                }
            }
        });
    });
}

/// A status and a body.
type Answer = (u16, Vec<u8>);

#[derive(Default)]
struct Answers {
    /// For IAM.
    token: Answer,
    /// For the API, in turn; then "not found".
    others: VecDeque<Answer>,
    /// Whether the next request is refused for its token, so that each run asks for one.
    is_refused: bool,
}

struct Service {
    runtime: tokio::runtime::Runtime,
    client: Client,
    answers: Arc<Mutex<Answers>>,
}

thread_local! {
    /// Time is real here, as the sockets are; so the client is told to wait for nothing.
    static SERVICE: RefCell<Service> = RefCell::new({
        let runtime = tokio::runtime::Builder::new_current_thread()
            .enable_all()
            .build()
            .expect("a runtime");
        let listener = runtime.block_on(TcpListener::bind("127.0.0.1:0")).expect("a free port");
        let address = format!("http://{}", listener.local_addr().expect("it is bound"));
        let answers = Arc::<Mutex<Answers>>::default();
        runtime.spawn(serving(listener, Arc::clone(&answers)));
        let endpoints = Endpoints::new(Some(&address), Some(&address), "us-east");
        let crn = "crn:v1:bluemix:public:quantum-computing:us-east:a/1:2::".parse();
        let credentials =
            Credentials { key: Secret::new("the-key".to_owned()), crn: crn.expect("a CRN") };
        let patience = Patience {
            request: Duration::from_secs(10),
            tries: 1,
            backoff: Duration::ZERO,
            rate_limited: Duration::ZERO,
            rate_limited_tries: 2,
            poll: Duration::ZERO,
            poll_most: Duration::ZERO,
            outage: Duration::ZERO,
        };
        let endpoints = endpoints.expect("addresses of this machine");
        let client = Client::new(endpoints, credentials, patience).expect("a client");
        Service { runtime, client, answers }
    });
}

fn answers_in(mut data: &[u8]) -> VecDeque<Answer> {
    const STATUSES: [u16; 9] = [200, 201, 204, 400, 401, 404, 409, 429, 503];
    let mut answers = VecDeque::new();
    while let [status, low, high, rest @ ..] = data {
        let length = usize::from(u16::from_le_bytes([*low, *high])).min(rest.len());
        let (body, left) = rest.split_at(length);
        let status = STATUSES[usize::from(*status) % STATUSES.len()];
        // 204 has no body by HTTP's own rules.
        answers.push_back((status, if status == 204 { Vec::new() } else { body.to_vec() }));
        data = left;
    }
    answers
}

async fn serving(listener: TcpListener, answers: Arc<Mutex<Answers>>) {
    loop {
        if let Ok((connection, _)) = listener.accept().await {
            tokio::spawn(conversing(connection, Arc::clone(&answers)));
        }
    }
}

async fn conversing(mut connection: TcpStream, answers: Arc<Mutex<Answers>>) {
    let mut asked = Vec::new();
    let mut bytes = [0; 4096];
    while let Ok(length @ 1..) = connection.read(&mut bytes).await {
        asked.extend_from_slice(&bytes[..length]);
        while let Some(is_for_token) = next_request(&mut asked) {
            let (status, body) = answers.lock().expect("nobody panicked").next(is_for_token);
            let length = body.len();
            let head = format!(
                "HTTP/1.1 {status} X\r\nContent-Type: application/json\r\nContent-Length: {length}\r\n\r\n"
            );
            if connection.write_all(&[head.as_bytes(), &body].concat()).await.is_err() {
                return;
            }
        }
    }
}

impl Answers {
    fn next(&mut self, is_for_token: bool) -> Answer {
        if is_for_token {
            return if self.token.0 == 0 { (404, Vec::new()) } else { self.token.clone() };
        }
        if std::mem::take(&mut self.is_refused) {
            return (401, Vec::new());
        }
        self.others.pop_front().unwrap_or_else(|| (404, b"{}".to_vec()))
    }
}

/// Takes a whole request off the bytes that came; whether it is for a token.
fn next_request(asked: &mut Vec<u8>) -> Option<bool> {
    let head = asked.windows(4).position(|four| four == b"\r\n\r\n")? + 4;
    let text = String::from_utf8_lossy(&asked[..head]).to_lowercase();
    let body = text.lines().find_map(|line| line.strip_prefix("content-length:"));
    let body = body.map_or(0, |length| length.trim().parse().expect("reqwest writes a number"));
    if asked.len() < head + body {
        return None;
    }
    asked.drain(..head + body);
    Some(text.contains(" /identity/token "))
}
