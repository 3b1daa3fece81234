// Before the page: a machine in the address (`#machine=`) is this tab's from now on, and a scenario in it (`#scenario=`) is played once. The server never
// sees either.

/** Takes what the address holds; whether there was anything. */
function take() {
  const held = new URLSearchParams(location.hash.slice(1));
  const [machine, scenario] = [held.get("machine"), held.get("scenario")];
  if (machine !== null) {
    sessionStorage.setItem("machine", JSON.stringify({ machine, files: {} }));
    // Where it is refused, the page's own stands in for it.
    sessionStorage.removeItem("machine-before");
  }
  if (scenario !== null) sessionStorage.setItem("play", scenario);
  if (machine === null && scenario === null) return false;
  history.replaceState(null, "", location.pathname + location.search);
  return true;
}

take();
// A link that is opened in a tab which has the page changes nothing but what is behind `#`. Real drives are not left for it.
addEventListener("hashchange", () => take() && !sessionStorage.getItem("serial") && location.reload());
