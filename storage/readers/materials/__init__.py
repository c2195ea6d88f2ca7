"""What surfaces of scenes are made of: material libraries, glTF's materials, their textures.

`mtl` and `gltf_materials` give descriptions (`description`), in which textures are still files;
`finishing` decodes these (`pictures`) and makes `material.Material` of both.
"""
