// Typesets what pymdownx.arithmatex marked as a formula, with the copy of KaTeX that scripts/build-docs puts beside the pages.
document.addEventListener("DOMContentLoaded", function () {
  renderMathInElement(document.body, {
    delimiters: [
      { left: "\\(", right: "\\)", display: false },
      { left: "\\[", right: "\\]", display: true }
    ],
    throwOnError: true
  });
});
