// The way between the areas of the studio, the same on every page.

const AREAS = [['', 'Speak'], ['footage', 'Footage'], ['labelling', 'Labelling'], ['heads', 'Heads'], ['training', 'Training'], ['results', 'Results'], ['viewing', 'Viewing tests']];

const here = location.pathname.split('/')[1];
const nav = document.getElementById('areas');
for (const [name, title] of AREAS) {
  const link = document.createElement('a');
  link.href = name ? `/${name}/` : '/';
  link.textContent = title;
  if (name === here) link.setAttribute('aria-current', 'page');
  nav.append(link);
}
