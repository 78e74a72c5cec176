"""How far a scene's answers move with mesh, numerical choices and the ground: variants of the scene, run as a study."""
