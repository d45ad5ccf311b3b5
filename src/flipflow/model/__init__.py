"""The physics: fields, elements, load, system and screen. Solves nothing."""
