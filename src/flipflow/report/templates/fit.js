// What stands before the first part is one printed page: its figures shrink in print until it is.
// Where even that does not do, the first part follows without a new page.
{
  const part = document.querySelector("h2.page");
  const before = (one) => one.compareDocumentPosition(part) & Node.DOCUMENT_POSITION_FOLLOWING;
  const figures = part ? [...document.querySelectorAll("figure")].filter(before) : [];
  const height = () => {
    const feet = [...part.parentElement.children].filter(before);
    const last = feet[feet.length - 1].getBoundingClientRect().bottom;
    return last - feet[0].getBoundingClientRect().top;
  };
  const shrink = (share) => figures.forEach((one) => { one.style.zoom = share; });
  if (figures.length) {
    const room = 1050;  // pixels of an A4 page within its margins
    const share = [1, 0.92, 0.84, 0.76, 0.68].find((one) => { shrink(one); return height() <= room; });
    shrink("");
    if (share === undefined) part.classList.remove("page");
    else figures.forEach((one) => { one.classList.add("fitted"); one.style.setProperty("--share", share); });
  }
}
