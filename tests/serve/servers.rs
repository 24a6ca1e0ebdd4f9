//! Servers to talk to, in this process and as processes, and a client.

use hilt::config::Pipeline;
use hilt::data::weights;
use hilt::error::Error;
use hilt::interrupt::Interrupt;
use hilt::learn::Policy;
use hilt::robot::file::built_in::paper_robot;
use hilt::serve::{Array, PolicyHost, PolicyOptions, Server, Token, Value, WorldHost, encode};
use hilt::task::built_in::pick_up;
use std::io::{BufRead, BufReader};
use std::net::{SocketAddr, TcpStream};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::thread::{self, JoinHandle};
use std::time::Duration;
use tungstenite::client::{ClientRequestBuilder, client};
use tungstenite::{Message, WebSocket};

/// The binary under test.
pub const HILT: &str = env!("CARGO_BIN_EXE_hilt");
/// No answer takes so long.
pub const PATIENCE: Duration = Duration::from_secs(20);

/// A tiny policy for pick-up.
pub fn policy_file() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures/pick-up/policy.safetensors")
}

/// The same, read.
pub fn policy() -> Policy {
    let (tensors, meta, _) = weights::read(&policy_file(), "policy").expect("weights");
    Policy::from_tensors(&tensors, &meta).expect("a policy")
}

/// A host of it.
pub fn host(options: PolicyOptions) -> PolicyHost {
    PolicyHost::new(policy(), Some(&paper_robot()), options, Default::default()).expect("the robot's policy")
}

/// A policy server in this process; it ends with the value.
pub struct Served {
    pub address: SocketAddr,
    interrupt: Interrupt,
    thread: Option<JoinHandle<hilt::error::Result<()>>>,
}

impl Served {
    pub fn new(most: usize, token: Option<&str>) -> Self {
        Self::run(most, token, |server, stop| server.run(&host(PolicyOptions::default()), stop, &|_| ()))
    }

    /// One that is so patient with who is silent.
    pub fn patient(most: usize, patience: Duration) -> Self {
        Self::run(most, None, move |server, stop| {
            server.with_patience(patience).run(&host(PolicyOptions::default()), stop, &|_| ())
        })
    }

    /// With these options.
    pub fn with(options: PolicyOptions) -> Self {
        Self::run(4, None, |server, stop| server.run(&host(options), stop, &|_| ()))
    }

    /// The world of pick-up.
    pub fn world() -> Self {
        Self::run(4, None, |server, stop| {
            let pipeline = Pipeline::defaults(&pick_up());
            server.run(&WorldHost::new(&pipeline, 0, 50, stop), stop, &|_| ())
        })
    }

    fn run(
        most: usize,
        token: Option<&str>,
        work: impl FnOnce(Server, &Interrupt) -> hilt::error::Result<()> + Send + 'static,
    ) -> Self {
        let server = Server::bind("127.0.0.1".parse().expect("an address"), 0, token.map(Token::new), most).expect("a port");
        let (address, interrupt) = (server.address().expect("known"), Interrupt::default());
        let stop = interrupt.clone();
        let thread = thread::spawn(move || work(server, &stop));
        Served { address, interrupt, thread: Some(thread) }
    }

    pub fn end(mut self) {
        self.interrupt.raise(2);
        let ended = self.thread.take().expect("it runs").join().expect("no panic");
        assert!(matches!(ended, Err(Error::Interrupted)), "{ended:?}");
    }

    /// A conversation, behind its metadata.
    pub fn talk(&self) -> Talk {
        Talk::with(self.address, None).expect("a conversation")
    }
}

impl Drop for Served {
    fn drop(&mut self) {
        self.interrupt.raise(2);
    }
}

/// A client.
pub struct Talk(pub WebSocket<TcpStream>);

impl Talk {
    /// Connects and reads the metadata; the words of what is refused.
    pub fn with(address: SocketAddr, header: Option<(&str, &str)>) -> Result<Talk, String> {
        let stream = TcpStream::connect(address).map_err(|e| e.to_string())?;
        stream.set_nodelay(true).and_then(|()| stream.set_read_timeout(Some(PATIENCE))).expect("set");
        let mut request = ClientRequestBuilder::new(format!("ws://{address}").parse().expect("an address"));
        if let Some((name, value)) = header {
            request = request.with_header(name, value);
        }
        let (socket, _) = client(request, stream).map_err(|e| e.to_string())?;
        let mut talk = Talk(socket);
        assert!(matches!(talk.hear(), Some(Message::Binary(_))), "metadata come first");
        Ok(talk)
    }

    pub fn say(&mut self, bytes: Vec<u8>) -> bool {
        self.0.send(Message::binary(bytes)).is_ok()
    }

    /// The next message; `None` when the conversation is over.
    pub fn hear(&mut self) -> Option<Message> {
        loop {
            match self.0.read() {
                Ok(Message::Ping(_) | Message::Pong(_)) => {}
                Ok(Message::Close(_)) | Err(_) => return None,
                Ok(message) => return Some(message),
            }
        }
    }

    /// The answer to a good observation.
    pub fn ask(&mut self) -> Vec<f32> {
        self.ask_at(None)
    }

    /// The answer to one that begins an episode.
    pub fn ask_at(&mut self, episode: Option<u64>) -> Vec<f32> {
        assert!(self.say(observation_of(episode)));
        let Some(Message::Binary(bytes)) = self.hear() else { panic!("no answer") };
        let answer = hilt::serve::decode(&bytes).expect("msgpack");
        answer.get("actions").expect("actions").numbers().expect("numbers").values
    }
}

/// A row of pick-up: the arm in its ready pose.
pub fn row() -> Vec<f32> {
    let ready = paper_robot().ready.iter().map(|v| *v as f32).collect::<Vec<_>>();
    [ready, vec![0.0; 9], vec![0.45, 0.0, 0.025, 0.0, 0.0, 0.0, 1.0]].concat()
}

/// A good observation.
pub fn observation() -> Vec<u8> {
    observation_of(None)
}

/// The same, which may begin an episode.
fn observation_of(episode: Option<u64>) -> Vec<u8> {
    let row = row();
    let part = |numbers: &[f32]| Value::Array(Array::f32(&[numbers.len()], numbers));
    let mut all = Value::map([
        ("observation.state", part(&row[..18])),
        ("observation.environment_state", part(&row[18..])),
        ("prompt", Value::text("Pick up the block.")),
    ]);
    if let Some(episode) = episode {
        all.insert("frame_index", Value::Int(0));
        all.insert("episode_index", Value::Int(episode as i64));
    }
    encode(&all)
}

/// `hilt ARGUMENTS` that listens on a free port; it is killed with the value.
pub struct Process {
    pub child: Child,
    pub address: String,
}

impl Process {
    pub fn new(arguments: &[&str]) -> Self {
        let mut child = Command::new(HILT)
            .args(arguments)
            .args(["--port", "0"])
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn()
            .expect("the binary runs");
        let mut line = String::new();
        BufReader::new(child.stdout.take().expect("piped")).read_line(&mut line).expect("a line");
        assert!(line.starts_with("ws://127.0.0.1:"), "{arguments:?}: {line}");
        Process { child, address: line.trim().into() }
    }
}

impl Drop for Process {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}
