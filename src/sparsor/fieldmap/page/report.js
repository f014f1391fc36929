// A click on a column's head sorts the table of cells by it; another click turns the order round.
for (const head of document.querySelectorAll(".cells th")) {
  head.addEventListener("click", () => {
    const descending = head.getAttribute("aria-sort") === "ascending";
    const body = head.closest("table").tBodies[0];
    const value = (line) => Number(line.cells[head.cellIndex].textContent);
    const lines = [...body.rows].sort((one, other) => (value(one) - value(other)) * (descending ? -1 : 1));
    for (const other of head.parentElement.cells) other.removeAttribute("aria-sort");
    head.setAttribute("aria-sort", descending ? "descending" : "ascending");
    body.append(...lines);
  });
}
