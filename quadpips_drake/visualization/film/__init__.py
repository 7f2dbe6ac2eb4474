"""Films: meshes in a rendered scene, words over a picture, files of video."""
