-- Which failure modes are left, and what share of the assets is each?
SELECT failure_mode, count(*) AS assets, round(100 * count(*) / sum(count(*)) OVER (), 1) AS percent,
    array_to_string((list(asset_id ORDER BY asset_id) FILTER (status = 'failed'))[1:3], ', ') AS "for example"
FROM assets GROUP BY failure_mode ORDER BY assets DESC, failure_mode
