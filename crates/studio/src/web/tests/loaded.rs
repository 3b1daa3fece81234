//! A log that a page loads, through the router.

use axum::http::StatusCode;

use super::{ask, server, text, token};

/// CiA 301, 7.2.4.3: an expedited upload of 4 bytes is answered by 43h.
#[tokio::test]
async fn a_log_that_a_page_loads_is_shown_as_the_trace_is_until_another_is_loaded() {
    let (app, access, _inbox) = server(None);
    let bearer = format!("Bearer {}", token(&access));
    let headers = [("authorization", bearer.as_str()), ("origin", "http://127.0.0.1:8402")];
    let log = "(1700000000.500000) can0 604#406C600000000000\n(1700000000.750000) can0 584#436C6000C8000000\n(1700000000.800000) can0 705#7F\n";
    let load = async |name: &str, body: &str| {
        let answer = ask(&app, "POST", &format!("/api/trace/load?name={name}"), &headers, body).await;
        let status = answer.status();
        (status, serde_json::from_str::<serde_json::Value>(&text(answer).await).expect("JSON"))
    };
    let (_, loaded) = load("a.log", log).await;
    assert_eq!((&loaded["frames"], &loaded["oldest"]), (&3.into(), &0.into()), "{loaded}");
    let lines = async |number: &serde_json::Value, query: &str| {
        let answer = ask(&app, "GET", &format!("/api/trace/loaded/{number}{query}"), &headers, "").await;
        let status = answer.status();
        (status, serde_json::from_str::<serde_json::Value>(&text(answer).await).expect("JSON"))
    };
    let (_, shown) = lines(&loaded["number"], "?after=0&before=2000&node=4&transfers=true").await;
    let of = |line: &serde_json::Value| (line["at_s"].as_f64(), line["id"].clone(), line["took_ms"].as_f64());
    let all: Vec<_> = shown["lines"].as_array().expect("lines").iter().map(of).collect();
    assert_eq!(all, [(Some(0.25), "584".into(), Some(250.0))], "one line of the transfer: {shown}");
    assert_eq!((&shown["to"], &shown["next"]), (&3.into(), &3.into()));
    let (_, by_id) = lines(&loaded["number"], "/identifiers").await;
    let ids: Vec<_> = by_id["identifiers"].as_array().expect("rows").iter().map(|row| row["id"].clone()).collect();
    assert_eq!(ids, ["584", "604", "705"]);
    // Nothing of it is in the trace of the bus.
    let live = text(ask(&app, "GET", "/api/trace", &headers, "").await).await;
    assert!(live.contains("\"lines\":[]"), "{live}");
    for (name, body, why) in [("a.docx", "PK", "expected a log of frames"), ("a.log", "not a log\n", "has no frames")] {
        let (status, refused) = load(name, body).await;
        assert_eq!(status, StatusCode::BAD_REQUEST);
        assert!(refused["error"]["message"].as_str().expect("text").contains(why), "{refused}");
    }
    assert_eq!(lines(&loaded["number"], "").await.0, StatusCode::OK, "what was refused has not replaced it");
    load("b.log", log).await;
    assert_eq!(lines(&loaded["number"], "").await.0, StatusCode::NOT_FOUND);
    assert_eq!(lines(&"none".into(), "").await.0, StatusCode::BAD_REQUEST);
}
