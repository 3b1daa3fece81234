// Exchanges the password for a cookie. The server checks one password a second.
const trouble = document.getElementById("trouble");

document.getElementById("form").addEventListener("submit", async (event) => {
  event.preventDefault();
  trouble.textContent = "";
  /** @type {any} */
  const field = document.getElementById("password");
  const password = field.value;
  try {
    const answer = await fetch("/api/login", { method: "POST", body: JSON.stringify({ password }) });
    if (answer.ok) {
      location.replace("/");
      return;
    }
    trouble.textContent = (await answer.json()).error.message;
  } catch {
    trouble.textContent = "The server does not answer.";
  }
});
