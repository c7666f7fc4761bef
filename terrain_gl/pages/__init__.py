"""Pages: everything about maps that are not wholly on the GPU.

marks                                  voids, water and holes, as bits of posts and nodes
map                                    a map that is read page by page: numbers of pages, memory
edited_map, edited_records, widening   new heights over those on disk, and bounds that hold at once
crop                                   exact records of a part of the map: for builds, and after edits
rebuilding                             records of edited nodes, computed anew in a thread
sums, loader                           a page made ready for the GPU, by threads that read
pool, terrain, resident                pages on the GPU, in place of a `Terrain` and its `ErrorTables`
windows, sweep, light                  the sun and the sky of a page, from windows around it
wanted, streaming                      which pages a view needs, and when they come
"""
