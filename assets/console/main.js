const answer = await fetch("/api/behaviors");
const { behaviors } = await answer.json();
for (const behavior of behaviors) {
  const line = document.createElement("p");
  line.textContent = `${behavior.id} ${behavior.name} ${behavior.outcome}`;
  document.getElementById("main").append(line);
}
