// Keeps the files of the page, so that it works without a network. FILES and VERSION stand above: `cargo xtask web` writes them.

const NAME = `ferrodrive ${VERSION}`;

// Without skipWaiting(): a new version waits until no page of the old one is open, and no page has files of both.
addEventListener("install", (event) => {
  // What the page has just loaded is asked for anew, and not sent again where the host knows that it is the same.
  event.waitUntil(caches.open(NAME).then((cache) => cache.addAll(FILES.map((file) => new Request(file, { cache: "no-cache" })))));
});

addEventListener("activate", (event) => {
  const old = caches.keys().then((names) => Promise.all(names.filter((name) => name.startsWith("ferrodrive ") && name !== NAME).map((name) => caches.delete(name))));
  event.waitUntil(old.then(() => clients.claim()));
});

addEventListener("fetch", (event) => {
  if (event.request.method !== "GET") return;
  event.respondWith(caches.match(event.request, { ignoreSearch: true, cacheName: NAME }).then((kept) => kept ?? fetch(event.request)));
});
