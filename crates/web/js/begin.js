// Before the page: a machine in the address (`#machine=`) is this tab's from now on. The server never sees it.

const held = new URLSearchParams(location.hash.slice(1)).get("machine");
if (held !== null) {
  sessionStorage.setItem("machine", JSON.stringify({ machine: held, files: {} }));
  history.replaceState(null, "", location.pathname + location.search);
}
