//! A headless Chromium, driven over the pipe of its DevTools protocol: messages of JSON, each ended by a zero byte.

use std::io::{BufRead, BufReader, Write};
use std::path::Path;
use std::process::{Child, ChildStdin, Command, Stdio};
use std::sync::mpsc::{Receiver, channel};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use serde_json::{Value, json};

/// How long a message may take, on a machine that is busy with other things.
const PATIENCE: Duration = Duration::from_secs(120);

/// True once a page of ours, the report or a scene, has drawn itself.
const READY: &str = "(window.report || window.view) && document.readyState === 'complete'";

/// One browser at a time, so that load times are its own.
static ALONE: Mutex<()> = Mutex::new(());

/// A browser with one page.
pub struct Browser {
    process: Child,
    to: ChildStdin,
    from: Receiver<Value>,
    session: String,
    last: u64,
    /// What the page reported since it was opened.
    pub events: Vec<Value>,
    /// Where downloads go.
    pub folder: tempfile::TempDir,
    _alone: MutexGuard<'static, ()>,
}

impl Browser {
    /// Starts Chromium; says SKIPPED and gives nothing where there is none.
    pub fn start() -> Option<Self> {
        let names = ["chromium", "chromium-browser", "google-chrome"];
        let runs = |name: &&&str| {
            let quiet = Command::new(name).arg("--version").stderr(Stdio::null()).output();
            quiet.is_ok_and(|o| o.status.success())
        };
        let Some(name) = names.iter().find(runs) else {
            println!("SKIPPED: no Chromium");
            return None;
        };
        let alone = ALONE.lock().unwrap_or_else(PoisonError::into_inner);
        let folder = tempfile::tempdir().expect("a folder for the browser");
        // The browser reads its commands from descriptor 3 and answers on 4.
        let mut process = Command::new("sh")
            .args(["-c", r#"exec "$0" "$@" 3<&0 4>&1 </dev/null >/dev/null"#, name])
            .args(["--headless=new", "--no-sandbox", "--disable-gpu", "--disable-quic"])
            .args(["--no-first-run", "--disable-background-networking", "--disable-sync"])
            .args(["--disable-component-update", "--disable-dev-shm-usage", "--hide-scrollbars"])
            .args(["--window-size=1400,1000", "--remote-debugging-pipe"])
            // WebGL without a graphics card.
            .args(["--use-angle=swiftshader", "--enable-unsafe-swiftshader"])
            .arg(format!("--user-data-dir={}", folder.path().join("profile").display()))
            .arg("about:blank")
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn()
            .expect("Chromium starts");
        let to = process.stdin.take().expect("a pipe to the browser");
        let mut answers = BufReader::new(process.stdout.take().expect("a pipe from the browser"));
        let (send, from) = channel();
        std::thread::spawn(move || {
            let mut message = Vec::new();
            while answers.read_until(0, &mut message).is_ok_and(|n| n > 0) {
                message.pop();
                let parsed = serde_json::from_slice(&message).expect("the browser speaks JSON");
                if send.send(parsed).is_err() {
                    break;
                }
                message.clear();
            }
        });
        let mut browser = Self {
            process,
            to,
            from,
            session: String::new(),
            last: 0,
            events: Vec::new(),
            folder,
            _alone: alone,
        };
        let downloads = browser.folder.path().display().to_string();
        browser.call(
            "Browser.setDownloadBehavior",
            json!({"behavior": "allow", "downloadPath": downloads, "eventsEnabled": true}),
        );
        let page = browser.call("Target.createTarget", json!({"url": "about:blank"}));
        let attach = json!({"targetId": page["targetId"], "flatten": true});
        let session = browser.call("Target.attachToTarget", attach);
        browser.session = session["sessionId"].as_str().expect("a session").into();
        for domain in ["Runtime", "Log", "Network", "Page"] {
            browser.call(&format!("{domain}.enable"), json!({}));
        }
        Some(browser)
    }

    /// Calls a method and waits for its result.
    pub fn call(&mut self, method: &str, params: Value) -> Value {
        self.last += 1;
        let mut message = json!({"id": self.last, "method": method, "params": params});
        if !self.session.is_empty() {
            message["sessionId"] = json!(self.session);
        }
        self.to.write_all(format!("{message}\0").as_bytes()).expect("the browser listens");
        loop {
            let answer = self.from.recv_timeout(PATIENCE).expect("the browser answers");
            if answer["id"] == self.last {
                assert!(answer["error"].is_null(), "{method}: {}", answer["error"]);
                return answer["result"].clone();
            }
            self.events.push(answer);
        }
    }

    /// The value of an expression, awaited.
    pub fn value(&mut self, expression: &str) -> Value {
        let params = json!({"expression": expression, "awaitPromise": true, "returnByValue": true});
        let result = self.call("Runtime.evaluate", params);
        assert!(result["exceptionDetails"].is_null(), "{expression}: {result}");
        result["result"]["value"].clone()
    }

    /// Waits until an expression is true.
    pub fn until(&mut self, expression: &str) {
        let began = Instant::now();
        while self.value(&format!("!!({expression})")) != true {
            assert!(began.elapsed() < PATIENCE, "never true: {expression}");
            std::thread::sleep(Duration::from_millis(20));
        }
    }

    /// Opens a page of this content and waits until it is ready.
    pub fn open(&mut self, html: &str) {
        let file = self.folder.path().join("report.html");
        std::fs::write(&file, html).expect("a page to open");
        self.open_at(&address(&file));
    }

    /// Opens the page at an address and waits until it is ready.
    pub fn open_at(&mut self, address: &str) {
        self.call("Page.navigate", json!({"url": "about:blank"}));
        self.until("location.href === 'about:blank'");
        self.events.clear();
        self.call("Page.navigate", json!({"url": address}));
        self.until(READY);
    }

    /// Errors and warnings of the console, exceptions, and requests for anything but the page itself.
    pub fn complaints(&self) -> Vec<String> {
        let told = |event: &Value| {
            let (method, params) = (event["method"].as_str()?, &event["params"]);
            let bad = match method {
                "Runtime.exceptionThrown" => true,
                "Runtime.consoleAPICalled" => {
                    ["error", "warning", "assert"].contains(&params["type"].as_str()?)
                }
                "Log.entryAdded" => {
                    let entry = &params["entry"];
                    // How fast a card or its stand-in is, is no fault of the page.
                    let speed = entry["text"].as_str()?.contains("GL Driver Message (OpenGL, Perf");
                    !speed && ["error", "warning"].contains(&entry["level"].as_str()?)
                }
                "Network.requestWillBeSent" => {
                    let url = params["request"]["url"].as_str()?;
                    let inside = ["data:", "blob:", "about:"];
                    let page = url.split('#').next()?.ends_with("/report.html");
                    !page && !inside.iter().any(|scheme| url.starts_with(scheme))
                }
                _ => false,
            };
            bad.then(|| format!("{method}: {params}"))
        };
        self.events.iter().filter_map(told).collect()
    }

    /// The content of a file that the page has saved, once the browser says that it is whole: a file of that name may
    /// stand, empty, before.
    pub fn saved(&mut self, name: &str) -> Vec<u8> {
        let began = Instant::now();
        while !self.is_saved(name) {
            let left = PATIENCE.saturating_sub(began.elapsed());
            let Ok(event) = self.from.recv_timeout(left) else {
                panic!("never saved: {name}; {:?}", self.complaints());
            };
            self.events.push(event);
        }
        std::fs::read(self.folder.path().join(name)).expect("a saved file")
    }

    fn is_saved(&self, name: &str) -> bool {
        let of = |method| self.events.iter().filter(move |e| e["method"] == method);
        of("Browser.downloadWillBegin").any(|begun| {
            let guid = &begun["params"]["guid"];
            begun["params"]["suggestedFilename"] == name
                && of("Browser.downloadProgress")
                    .any(|e| e["params"]["guid"] == *guid && e["params"]["state"] == "completed")
        })
    }
}

impl Drop for Browser {
    fn drop(&mut self) {
        let _ = self.process.kill();
        let _ = self.process.wait();
    }
}

/// The address of a file.
pub fn address(file: &Path) -> String {
    format!("file://{}", file.display())
}
